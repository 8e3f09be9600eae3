// SPDX-License-Identifier: Apache-2.0
// A file without a name for what memory must not hold: gone with the process, however it ends.
#pragma once
#include <cstdio>
#include <memory>
#include <string>

namespace loxo {

struct SpoolCloser {
  void operator()(std::FILE* f) const { std::fclose(f); }
};
using SpoolFile = std::unique_ptr<std::FILE, SpoolCloser>;

// In $TMPDIR, else the system's folder for temporary files. Throws Error(kWork) where none can be
// made.
SpoolFile open_spool();
// Where, for messages.
std::string spool_folder();
// Throws Error(kWork): `what` cannot be written there.
[[noreturn]] void spool_failed(const char* what);

}  // namespace loxo
