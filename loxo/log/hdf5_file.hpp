// SPDX-License-Identifier: Apache-2.0
// The door of HDF5: the binary form of drives and solutions, and other people's tables. A table is
// a group; each of its columns is a dataset of one dimension (a matrix of up to 64 columns is that
// many: name_1, name_2 …). Files are in the format of HDF5 1.10, whose checksums tell damage.
#pragma once
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "loxo/log/table.hpp"

namespace loxo {

// By its first bytes.
bool is_h5(const std::string& path);
// Groups that hold columns, "" for the root, in the file's order. Throws Error(kInput).
std::vector<std::string> h5_tables(const std::string& path);
// A dataset that is one text; none if there is no such dataset.
std::optional<std::string> h5_text(const std::string& path, const std::string& name);
// Throws Error(kInput): no such group (those found are named), no columns, columns of different
// lengths, a damaged file.
std::unique_ptr<Table> open_h5_table(const std::string& path, const std::string& group);

// Rows streamed into columns; the file appears whole at commit() or not at all. Throws
// Error(kWork) on a full disk or a missing folder.
class H5Writer {
 public:
  explicit H5Writer(const std::string& path);
  ~H5Writer();
  H5Writer(H5Writer&&) noexcept;

  // A dataset that is one text.
  void text(const std::string& name, std::string_view value);
  // Another name of a table.
  void link(const std::string& group, const std::string& as);
  // The table that row() fills, "" for the root; ends the one before. `words` are those of the
  // columns that are text.
  void begin(const std::string& group, const std::vector<std::string>& columns,
             const std::vector<std::string>& words = {});
  // Of the table begun last.
  void attribute(const std::string& key, std::string_view value);
  // Numbers and texts, each in the order of the columns.
  void row(std::span<const double> numbers, std::span<const std::string_view> words = {});
  void commit();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace loxo
