// SPDX-License-Identifier: Apache-2.0
// A drive being written: the folder that appears whole or not at all, its channels as CSV, and the
// sections of drive.toml that describe them.
#pragma once
#include <initializer_list>
#include <memory>
#include <string>

#include "loxo/log/drive.hpp"
#include "loxo/text/csv.hpp"

namespace loxo {

// Written aside, renamed by commit(). Throws Error(kUsage) where `path` is there already,
// Error(kWork) where its parent is missing or cannot be written.
class DriveFolder {
 public:
  explicit DriveFolder(std::string path);
  ~DriveFolder();  // removes the unfinished folder if commit() was not called
  DriveFolder(const DriveFolder&) = delete;
  DriveFolder& operator=(const DriveFolder&) = delete;
  const std::string& path() const { return aside_; }
  std::string file(const std::string& name) const { return aside_ + "/" + name; }
  void commit();

 private:
  std::string path_, aside_;
  bool done_ = false;
};

// A channel's file: rows of numbers that read back to the same double; ".h5" is the binary form.
class ChannelWriter {
 public:
  ChannelWriter(const std::string& path, const std::string& header);
  ~ChannelWriter();
  ChannelWriter(ChannelWriter&&) noexcept;
  void row(std::initializer_list<double> values);
  void commit();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The shortest text that reads back to the same double.
std::string number_text(double x);

// "errors = { … }" of what is declared: a value that is not given or zero is left out.
class ErrorsLine {
 public:
  void add(const char* key, double x, const char* unit);
  std::string line() const;  // with its line end; empty where nothing was added

 private:
  std::string text_;
};

// [start] with a whole state: ECEF, q body -> ECEF; 1 sigma of each axis of what may be wrong with
// it, m, m/s, rad, rad (0 or nan: not declared).
std::string start_section(double t, const Point<Ecef>& r, const Vec<Ecef>& v,
                          const Quat<Ecef, Body>& q, double position, double velocity, double level,
                          double heading);

// [imu] of increments in `file` and [reference] in `file` with the solution's columns; the header
// of the first.
extern const char* const kImuIncrementHeader;
std::string imu_increment_section(const ErrorsLine& errors, const std::string& file = "imu.csv");
std::string reference_section(const std::string& file = "reference.csv");
std::string benchmark_section(const NamedBenchmark& benchmark);

}  // namespace loxo
