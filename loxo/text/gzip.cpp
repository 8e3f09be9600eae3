// SPDX-License-Identifier: Apache-2.0
#include "loxo/text/gzip.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <new>
#include <vector>

#include "loxo/num/error.hpp"

namespace loxo {

struct ByteSource::Impl {
  std::string name, fault;
  int fd = -1;
  bool own = false, gz = false, started = false, raw_end = false, ended = false;
  z_stream z{};
  bool z_open = false, z_done = false;  // z_done: at the end of a gzip member
  std::vector<unsigned char> in;
  std::size_t in_at = 0, in_end = 0;

  ~Impl() {
    if (z_open) inflateEnd(&z);
    if (own && fd >= 0) ::close(fd);
  }
  std::size_t raw(void* to, std::size_t n) {
    for (;;) {
      const ssize_t got = ::read(fd, to, n);
      if (got >= 0) return static_cast<std::size_t>(got);
      if (errno != EINTR)
        throw Error(ErrorKind::kInput, std::string("cannot be read: ") + std::strerror(errno),
                    name);
    }
  }
  void fill() {
    if (in_at < in_end || raw_end) return;
    in_at = 0;
    in_end = raw(in.data(), in.size());
    raw_end = in_end == 0;
  }
  // The first bytes say whether this is gzip; a pipe may give them one at a time.
  void start() {
    started = true;
    in.resize(1u << 18);
    while (in_end < 2 && !raw_end) {
      const std::size_t got = raw(in.data() + in_end, in.size() - in_end);
      in_end += got;
      raw_end = got == 0;
    }
    gz = in_end >= 2 && in[0] == 0x1f && in[1] == 0x8b;
    if (gz) {
      if (inflateInit2(&z, 15 + 16) != Z_OK) throw std::bad_alloc();
      z_open = true;
    }
  }
  std::size_t inflate_some(char* to, std::size_t n) {
    z.next_out = reinterpret_cast<Bytef*>(to);
    z.avail_out = static_cast<uInt>(n);
    while (z.avail_out > 0 && fault.empty()) {
      fill();
      if (in_at == in_end) {
        if (!z_done) fault = "ends early (truncated gzip stream)";
        break;
      }
      if (z_done) {  // another member, or padding after the last
        if (in[in_at] != 0x1f) {
          for (; in_at < in_end && in[in_at] == 0; ++in_at) {
          }
          if (in_at == in_end) continue;
          if (in[in_at] != 0x1f) {
            fault = "is damaged (bytes after the end of the gzip stream)";
            break;
          }
        }
        inflateReset(&z);
        z_done = false;
      }
      z.next_in = in.data() + in_at;
      z.avail_in = static_cast<uInt>(in_end - in_at);
      const int rc = ::inflate(&z, Z_NO_FLUSH);
      in_at = in_end - z.avail_in;
      if (rc == Z_STREAM_END) {
        z_done = true;
      } else if (rc != Z_OK && rc != Z_BUF_ERROR) {
        fault = std::string("is damaged (gzip: ") + (z.msg != nullptr ? z.msg : "unreadable") + ")";
      }
    }
    return n - z.avail_out;
  }
};

ByteSource::ByteSource(const std::string& path) : impl_(std::make_unique<Impl>()) {
  impl_->name = path == "-" ? "standard input" : path;
  if (path == "-") {
    impl_->fd = 0;
    return;
  }
  struct stat st {};
  if (::stat(path.c_str(), &st) != 0) {
    throw Error(
        ErrorKind::kInput,
        errno == ENOENT ? "no such file" : std::string("cannot be opened: ") + std::strerror(errno),
        path);
  }
  if (S_ISDIR(st.st_mode)) throw Error(ErrorKind::kInput, "is a folder; expected a file", path);
  impl_->fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (impl_->fd < 0)
    throw Error(ErrorKind::kInput, std::string("cannot be opened: ") + std::strerror(errno), path);
  impl_->own = true;
}
ByteSource::~ByteSource() = default;
ByteSource::ByteSource(ByteSource&&) noexcept = default;
ByteSource& ByteSource::operator=(ByteSource&&) noexcept = default;

std::size_t ByteSource::read(char* to, std::size_t n) {
  Impl& s = *impl_;
  if (!s.started) s.start();
  if (n > (1u << 30)) n = 1u << 30;
  if (s.gz) return s.inflate_some(to, n);
  if (s.in_at < s.in_end) {  // the bytes that start() looked at
    const std::size_t m = std::min(n, s.in_end - s.in_at);
    std::memcpy(to, s.in.data() + s.in_at, m);
    s.in_at += m;
    return m;
  }
  return s.raw_end ? 0 : s.raw(to, n);
}
const std::string& ByteSource::fault() const { return impl_->fault; }
bool ByteSource::compressed() const { return impl_->gz; }
const std::string& ByteSource::name() const { return impl_->name; }

std::string read_file(const std::string& path) {
  ByteSource source(path);
  std::string text;
  char block[1 << 16];
  for (std::size_t n; (n = source.read(block, sizeof block)) > 0;) text.append(block, n);
  if (!source.fault().empty()) throw Error(ErrorKind::kInput, source.fault(), source.name());
  return text;
}

struct GzipSink::Impl {
  z_stream z{};
};
GzipSink::GzipSink() : impl_(std::make_unique<Impl>()) {
  if (deflateInit2(&impl_->z, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
}
GzipSink::~GzipSink() { deflateEnd(&impl_->z); }

void GzipSink::deflate(std::string_view text, bool finish, std::string& out) {
  z_stream& z = impl_->z;
  // zlib does not write to its input; its type only lacks the const.
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  z.avail_in = static_cast<uInt>(text.size());
  char block[1 << 16];
  do {
    z.next_out = reinterpret_cast<Bytef*>(block);
    z.avail_out = sizeof block;
    ::deflate(&z, finish ? Z_FINISH : Z_NO_FLUSH);
    out.append(block, sizeof block - z.avail_out);
  } while (z.avail_out == 0);
}

}  // namespace loxo
