// SPDX-License-Identifier: Apache-2.0
// A file that appears whole or not at all: written under a name beside its place, renamed by
// commit(), removed where that was never called and on Ctrl-C.
#pragma once
#include <memory>
#include <string>

namespace loxo {

class AsideFile {
 public:
  // Throws Error(kWork): the folder does not exist, or the path is a folder. A link stays a link.
  explicit AsideFile(const std::string& path);
  ~AsideFile();
  AsideFile(AsideFile&&) noexcept;
  // Where to write; nothing is there yet.
  const std::string& temporary() const;
  // The name it will have.
  const std::string& path() const;
  void commit();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Error(kWork) for an errno of a write: "disk full: …" or "cannot be written: …".
[[noreturn]] void throw_unwritable(int error, const std::string& path);

// A folder that appears whole or not at all, as AsideFile. Throws Error(kUsage) where something of
// that name is there already, Error(kWork) where it cannot be made.
class AsideFolder {
 public:
  explicit AsideFolder(std::string path);
  ~AsideFolder();
  AsideFolder(const AsideFolder&) = delete;
  AsideFolder& operator=(const AsideFolder&) = delete;
  std::string file(const std::string& name) const { return aside_ + "/" + name; }
  void commit();

 private:
  std::string path_, aside_;
  bool done_ = false;
};

}  // namespace loxo
