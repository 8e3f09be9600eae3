// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/spool.hpp"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "loxo/num/error.hpp"

namespace loxo {

std::string spool_folder() {
  std::error_code none;
  const std::filesystem::path p = std::filesystem::temp_directory_path(none);
  if (!none) return p.string();
  const char* told = std::getenv("TMPDIR");  // a folder that is not there is told as it was given
  return told ? told : "/tmp";
}

SpoolFile open_spool() {
  std::string name = spool_folder() + "/loxo-spool-XXXXXX";
  const int fd = ::mkstemp(name.data());
  std::FILE* f = fd < 0 ? nullptr : ::fdopen(fd, "w+b");
  if (fd >= 0) ::unlink(name.c_str());
  if (!f) {
    if (fd >= 0) ::close(fd);
    throw Error(ErrorKind::kWork, "no temporary file can be made in " + spool_folder() +
                                      "; TMPDIR names another folder");
  }
  std::setvbuf(f, nullptr, _IOFBF, 1u << 20);
  return SpoolFile(f);
}

void spool_failed(const char* what) {
  throw Error(ErrorKind::kWork, std::string(what) + " cannot be written to a temporary file in " +
                                    spool_folder() + ": disk full? TMPDIR names another folder");
}

}  // namespace loxo
