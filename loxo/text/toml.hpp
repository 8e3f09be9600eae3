// SPDX-License-Identifier: Apache-2.0
// The door of TOML: a parsed table that remembers where every key stands and which keys were asked
// for, so that an unknown key is refused with its line and the nearest valid name.
#pragma once
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "loxo/text/diagnostics.hpp"
#include "loxo/text/quantity.hpp"

namespace loxo {

class TomlTable {
 public:
  // Throws Error(kInput) with file:line:column for a syntax error.
  static TomlTable read(const std::string& path);
  static TomlTable parse(std::string_view text, const std::string& name);

  bool has(std::string_view key) const;
  std::vector<std::string> keys() const;
  std::string where(std::string_view key) const;  // "file:line:column: key section.key"
  std::string path() const;                       // dotted name of this table

  // Every getter throws Error(kInput, …, where) for a wrong type. `get_*` return nullopt when the
  // key is absent.
  std::optional<std::string> get_string(std::string_view key) const;
  std::optional<double> get_number(std::string_view key) const;  // a bare number
  std::optional<long long> get_integer(std::string_view key) const;
  std::optional<bool> get_bool(std::string_view key) const;
  // A quantity written as text with its unit; a bare number is refused unless d is kNone.
  std::optional<double> get_quantity(std::string_view key, Dimension d) const;
  std::optional<std::array<double, 3>> get_vector3(std::string_view key, Dimension d) const;
  std::optional<std::vector<std::string>> get_strings(std::string_view key) const;
  std::optional<std::vector<double>> get_numbers(std::string_view key) const;
  std::optional<std::vector<double>> get_quantities(std::string_view key, Dimension d) const;
  std::optional<TomlTable> get_table(std::string_view key) const;
  std::vector<TomlTable> get_tables(
      std::string_view key) const;  // array of tables; empty if absent
  // As get_*, but a missing key throws Error(kInput).
  std::string need_string(std::string_view key) const;
  double need_number(std::string_view key) const;
  double need_quantity(std::string_view key, Dimension d) const;

  // `--set a.b=value`: replaces or adds, value parsed as TOML, as text where that fails.
  void set(std::string_view dotted_key, std::string_view value);
  // Throws Error(kInput) for the first key, here and in all sub-tables, that nobody asked for
  // (has/get/need), with the nearest of those that were asked for.
  void refuse_unknown() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace loxo
