// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
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
#include <iostream>
#include <optional>

#include "loxo/num/error.hpp"
#include "loxo/text/csv.hpp"
#include "loxo/text/gzip.hpp"

namespace loxo {
namespace {

constexpr std::size_t kBuffer = 1u << 18;

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
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXFSZ}) {
      struct sigaction old {};
      if (::sigaction(signal, nullptr, &old) == 0 && old.sa_handler == SIG_DFL)
        std::signal(signal, remove_unfinished);
    }
    return true;
  }();
  static_cast<void>(once);
}

std::string folder_of(const std::string& path) {
  const auto slash = path.rfind('/');
  return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

}  // namespace

struct OutputFile::Impl {
  std::string path, temporary;
  int fd = -1;
  bool own = true, rename = false, committed = false;
  Unfinished* entry = nullptr;
  std::string buffer, packed;
  std::optional<GzipSink> gzip;

  ~Impl() {
    if (own && fd >= 0) ::close(fd);
    if (!committed && rename) ::unlink(temporary.c_str());
    if (entry != nullptr) entry->used = 0;
  }
  [[noreturn]] void fail(int error) const {
    throw Error(
        ErrorKind::kWork,
        std::string(error == ENOSPC || error == EDQUOT ? "disk full: " : "cannot be written: ") +
            std::strerror(error),
        path);
  }
  void put(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t n = ::write(fd, bytes.data(), bytes.size());
      if (n < 0) {
        if (errno == EINTR) continue;
        fail(errno);
      }
      bytes.remove_prefix(static_cast<std::size_t>(n));
    }
  }
  void flush(bool finish) {
    if (gzip) {
      packed.clear();
      gzip->deflate(buffer, finish, packed);
      put(packed);
    } else {
      put(buffer);
    }
    buffer.clear();
  }
};

OutputFile::OutputFile(const std::string& path) : impl_(std::make_unique<Impl>()) {
  Impl& f = *impl_;
  f.path = path == "-" ? "standard output" : path;
  f.buffer.reserve(kBuffer + (1u << 12));
  if (path.empty()) throw Error(ErrorKind::kUsage, "an output path is needed (-o PATH)");
  if (path == "-") {
    std::cout.flush();
    std::fflush(stdout);
    f.fd = 1;
    f.own = false;
    return;
  }
  if (path.size() > 3 && path.substr(path.size() - 3) == ".gz") f.gzip.emplace();
  std::string target = path;
  struct stat st {};
  if (::stat(path.c_str(), &st) == 0) {
    if (S_ISDIR(st.st_mode))
      throw Error(ErrorKind::kWork, "is a folder; expected a file to write", path);
    if (!S_ISREG(st.st_mode)) {  // a device or a pipe: nothing to rename
      f.fd = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
      if (f.fd < 0) f.fail(errno);
      return;
    }
    char real[PATH_MAX];
    if (::realpath(path.c_str(), real) != nullptr) target = real;  // a link stays a link
  }
  const std::string folder = folder_of(target);
  if (::stat(folder.c_str(), &st) != 0 || !S_ISDIR(st.st_mode)) {
    throw Error(ErrorKind::kWork, "the folder '" + folder + "' does not exist", path);
  }
  static std::atomic<unsigned> number{0};
  f.temporary = folder + "/." + target.substr(target.rfind('/') + 1) + ".part" +
                std::to_string(::getpid()) + "-" + std::to_string(number++);
  f.path = target;
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
  f.fd = ::open(f.temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (f.fd < 0) f.fail(errno);
  f.rename = true;
}
OutputFile::~OutputFile() = default;
OutputFile::OutputFile(OutputFile&&) noexcept = default;

void OutputFile::write(std::string_view text) {
  Impl& f = *impl_;
  if (text.size() > kBuffer) {
    f.flush(false);
    while (text.size() > kBuffer) {  // zlib counts input in 32 bits
      f.buffer.assign(text.substr(0, kBuffer));
      f.flush(false);
      text.remove_prefix(kBuffer);
    }
  }
  f.buffer += text;
  if (f.buffer.size() >= kBuffer) f.flush(false);
}

void OutputFile::commit() {
  Impl& f = *impl_;
  if (f.committed) return;
  f.flush(true);
  if (f.own) {
    const int fd = f.fd;
    f.fd = -1;
    if (::close(fd) != 0) f.fail(errno);
  }
  if (f.rename && std::rename(f.temporary.c_str(), f.path.c_str()) != 0) f.fail(errno);
  f.committed = true;
  if (f.entry != nullptr) {
    f.entry->used = 0;
    f.entry = nullptr;
  }
}

std::string file_hash(const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) throw Error(ErrorKind::kInput, std::strerror(errno), path);
  std::uint64_t hash = 0xcbf29ce484222325u;
  static thread_local std::array<unsigned char, 1u << 16> block;
  for (std::size_t n; (n = std::fread(block.data(), 1, block.size(), file)) > 0;) {
    for (std::size_t i = 0; i < n; ++i) hash = (hash ^ block[i]) * 0x100000001b3u;
  }
  const bool bad = std::ferror(file) != 0;
  std::fclose(file);
  if (bad) throw Error(ErrorKind::kInput, "cannot be read (a folder?)", path);
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

}  // namespace loxo
