// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <optional>

#include "loxo/num/error.hpp"
#include "loxo/text/aside.hpp"
#include "loxo/text/csv.hpp"
#include "loxo/text/gzip.hpp"

namespace loxo {
namespace {

constexpr std::size_t kBuffer = 1u << 18;

}  // namespace

struct OutputFile::Impl {
  std::string path;
  int fd = -1;
  bool own = true, committed = false;
  std::optional<AsideFile> aside;
  std::string buffer, packed;
  std::optional<GzipSink> gzip;

  ~Impl() {
    if (own && fd >= 0) ::close(fd);
  }
  void put(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t n = ::write(fd, bytes.data(), bytes.size());
      if (n < 0) {
        if (errno == EINTR) continue;
        throw_unwritable(errno, path);
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
  struct stat st {};
  if (::stat(path.c_str(), &st) == 0 && !S_ISREG(st.st_mode) && !S_ISDIR(st.st_mode)) {
    f.fd = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);  // a device or a pipe: nothing to rename
    if (f.fd < 0) throw_unwritable(errno, path);
    return;
  }
  f.aside.emplace(path);
  f.path = f.aside->path();
  f.fd = ::open(f.aside->temporary().c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (f.fd < 0) throw_unwritable(errno, f.path);
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
    if (::close(fd) != 0) throw_unwritable(errno, f.path);
  }
  if (f.aside) f.aside->commit();
  f.committed = true;
}

std::string file_hash(const std::string& path) {
  constexpr std::uint64_t kBasis = 0xcbf29ce484222325u, kPrime = 0x100000001b3u;
  constexpr std::size_t kLanes = 8, kStride = 8 * kLanes;
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) throw Error(ErrorKind::kInput, std::strerror(errno), path);
  std::uint64_t lane[kLanes];
  for (std::size_t i = 0; i < kLanes; ++i) lane[i] = kBasis + i;
  alignas(64) static thread_local std::array<char, 1u << 17> block;
  std::size_t held = 0;
  bool whole = false;
  for (;;) {
    const ssize_t n = ::read(fd, block.data() + held, block.size() - held);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) {
      const int error = errno;
      ::close(fd);
      throw Error(ErrorKind::kInput, std::string("cannot be read: ") + std::strerror(error), path);
    }
    held += static_cast<std::size_t>(n);
    std::size_t at = 0;
    for (; at + kStride <= held; at += kStride) {
      for (std::size_t i = 0; i < kLanes; ++i) {
        std::uint64_t w;
        std::memcpy(&w, block.data() + at + 8 * i, 8);
        lane[i] = (lane[i] ^ w) * kPrime;
        lane[i] ^= lane[i] >> 32;  // a product carries upwards only
      }
      whole = true;
    }
    std::memmove(block.data(), block.data() + at, held - at);
    held -= at;
    if (n == 0) break;
  }
  ::close(fd);
  std::uint64_t hash = kBasis;
  const auto add = [&](unsigned char c) { hash = (hash ^ c) * kPrime; };
  if (whole)
    for (const std::uint64_t h : lane)
      for (int k = 0; k < 64; k += 8) add(static_cast<unsigned char>(h >> k));
  for (std::size_t i = 0; i < held; ++i) add(static_cast<unsigned char>(block[i]));
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

}  // namespace loxo
