// SPDX-License-Identifier: Apache-2.0
// The door of zlib: bytes of a file or of standard input, plain or gzip (told apart by content, not
// by name), and a compressor for output.
#pragma once
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

namespace loxo {

class ByteSource {
 public:
  // "-" is standard input. Throws Error(kInput): missing, a directory, not readable.
  explicit ByteSource(const std::string& path);
  ~ByteSource();
  ByteSource(ByteSource&&) noexcept;
  ByteSource& operator=(ByteSource&&) noexcept;
  // Up to n bytes; 0 at the end. Throws Error(kInput) when the device fails.
  std::size_t read(char* to, std::size_t n);
  // Not empty once the gzip stream broke: "ends early" or "is damaged" with the reason. Bytes
  // before were given.
  const std::string& fault() const;
  bool compressed() const;
  // The path, or "standard input".
  const std::string& name() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// A whole small file. Throws as ByteSource, and for a broken gzip stream.
std::string read_file(const std::string& path);

class GzipSink {
 public:
  GzipSink();
  ~GzipSink();
  // Appends compressed bytes of `text` to `out`; `finish` ends the stream.
  void deflate(std::string_view text, bool finish, std::string& out);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace loxo
