// SPDX-License-Identifier: Apache-2.0
#include "loxo/text/aside.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "loxo/num/error.hpp"

namespace loxo {
namespace {

// Unfinished files, for the signal handler: only async-signal-safe calls may run there, so fixed
// storage.
struct Unfinished {
  std::atomic<int> used{0};  // 0 free, 1 being filled, 2 to be removed on a signal
  char path[PATH_MAX]{};
};
std::array<Unfinished, 64> unfinished;

extern "C" void remove_unfinished(int signal) {
  for (auto& u : unfinished) {
    if (u.used.load() == 2) ::unlink(u.path);
  }
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

// Only where nobody else (a campaign that can be resumed) listens already.
void listen_to_signals() {
  static const bool once = [] {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) {
      struct sigaction old {};
      if (::sigaction(signal, nullptr, &old) == 0 && old.sa_handler == SIG_DFL)
        std::signal(signal, remove_unfinished);
    }
    // A limit of file size is a write that fails, with its message, not a death.
    std::signal(SIGXFSZ, SIG_IGN);
    return true;
  }();
  static_cast<void>(once);
}

std::string folder_of(const std::string& path) {
  const auto slash = path.rfind('/');
  return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

}  // namespace

void throw_unwritable(int error, const std::string& path) {
  const bool full = error == ENOSPC || error == EDQUOT || error == EFBIG;
  throw Error(ErrorKind::kWork,
              std::string(full ? "disk full: " : "cannot be written: ") + std::strerror(error),
              path);
}

struct AsideFile::Impl {
  std::string path, temporary;
  bool committed = false;
  Unfinished* entry = nullptr;

  void release() {
    if (entry != nullptr) entry->used = 0;
    entry = nullptr;
  }
  ~Impl() {
    if (!committed && !temporary.empty()) ::unlink(temporary.c_str());
    release();
  }
};

AsideFile::AsideFile(const std::string& path) : impl_(std::make_unique<Impl>()) {
  Impl& f = *impl_;
  f.path = path;
  struct stat st {};
  if (::stat(path.c_str(), &st) == 0) {
    if (S_ISDIR(st.st_mode))
      throw Error(ErrorKind::kWork, "is a folder; expected a file to write", path);
    char real[PATH_MAX];
    if (::realpath(path.c_str(), real) != nullptr) f.path = real;
  }
  const std::string folder = folder_of(f.path);
  if (::stat(folder.c_str(), &st) != 0 || !S_ISDIR(st.st_mode))
    throw Error(ErrorKind::kWork, "the folder '" + folder + "' does not exist", path);
  static std::atomic<unsigned> number{0};
  f.temporary = folder + "/." + f.path.substr(f.path.rfind('/') + 1) + ".part" +
                std::to_string(::getpid()) + "-" + std::to_string(number++);
  listen_to_signals();
  for (auto& u : unfinished) {
    int expected = 0;
    if (f.temporary.size() < sizeof u.path && u.used.compare_exchange_strong(expected, 1)) {
      std::memcpy(u.path, f.temporary.c_str(), f.temporary.size() + 1);
      u.used = 2;
      f.entry = &u;
      break;
    }
  }
}
AsideFile::~AsideFile() = default;
AsideFile::AsideFile(AsideFile&&) noexcept = default;
const std::string& AsideFile::temporary() const { return impl_->temporary; }
const std::string& AsideFile::path() const { return impl_->path; }

void AsideFile::commit() {
  Impl& f = *impl_;
  if (f.committed) return;
  if (std::rename(f.temporary.c_str(), f.path.c_str()) != 0) throw_unwritable(errno, f.path);
  f.committed = true;
  f.release();
}

AsideFolder::AsideFolder(std::string path) : path_(std::move(path)) {
  while (path_.size() > 1 && path_.back() == '/') path_.pop_back();
  aside_ = path_ + ".unfinished-" + std::to_string(::getpid());
  std::error_code failed;
  if (std::filesystem::exists(path_, failed))
    throw Error(ErrorKind::kUsage, "'" + path_ + "' is there already", "-o");
  std::filesystem::create_directory(aside_, failed);
  if (failed) throw Error(ErrorKind::kWork, "cannot make the folder: " + failed.message(), path_);
}
AsideFolder::~AsideFolder() {
  std::error_code ignored;
  if (!done_) std::filesystem::remove_all(aside_, ignored);
}
void AsideFolder::commit() {
  if (std::rename(aside_.c_str(), path_.c_str()) != 0) throw_unwritable(errno, path_);
  done_ = true;
}

}  // namespace loxo
