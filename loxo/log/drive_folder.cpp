// SPDX-License-Identifier: Apache-2.0
#include "loxo/log/drive_folder.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <vector>

#include "loxo/log/hdf5_file.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"

namespace loxo {

DriveFolder::DriveFolder(std::string path)
    : path_(std::move(path)), aside_(path_ + ".unfinished-" + std::to_string(::getpid())) {
  if (std::filesystem::exists(path_))
    throw Error(ErrorKind::kUsage, "'" + path_ + "' is there already", "-o");
  std::error_code failed;
  std::filesystem::create_directory(aside_, failed);
  if (failed) throw Error(ErrorKind::kWork, "cannot make the folder: " + failed.message(), path_);
}
DriveFolder::~DriveFolder() {
  std::error_code ignored;
  if (!done_) std::filesystem::remove_all(aside_, ignored);
}
void DriveFolder::commit() {
  std::error_code failed;
  std::filesystem::rename(aside_, path_, failed);
  if (failed) throw Error(ErrorKind::kWork, "cannot name the folder: " + failed.message(), path_);
  done_ = true;
}

struct ChannelWriter::Impl {
  std::unique_ptr<OutputFile> text_file;
  std::unique_ptr<H5Writer> binary_file;
  std::string text;
  void flush() {
    text_file->write(text);
    text.clear();
  }
};
ChannelWriter::ChannelWriter(const std::string& path, const std::string& header)
    : impl_(std::make_unique<Impl>()) {
  if (!path.ends_with(".h5")) {
    impl_->text_file = std::make_unique<OutputFile>(path);
    impl_->text = header + "\n";
    return;
  }
  impl_->binary_file = std::make_unique<H5Writer>(path);
  std::vector<std::string> columns(1);
  for (const char c : header) {
    if (c == ',')
      columns.emplace_back();
    else
      columns.back() += c;
  }
  impl_->binary_file->begin("", columns);
}
ChannelWriter::~ChannelWriter() = default;
ChannelWriter::ChannelWriter(ChannelWriter&&) noexcept = default;
void ChannelWriter::row(std::initializer_list<double> values) {
  if (impl_->binary_file) {
    impl_->binary_file->row({values.begin(), values.size()});
    return;
  }
  bool first = true;
  for (const double x : values) {
    if (!first) impl_->text += ',';
    append_number(impl_->text, x);
    first = false;
  }
  impl_->text += '\n';
  if (impl_->text.size() > (1u << 16)) impl_->flush();
}
void ChannelWriter::commit() {
  if (impl_->binary_file) {
    impl_->binary_file->commit();
    return;
  }
  impl_->flush();
  impl_->text_file->commit();
}

std::string number_text(double x) {
  std::string s;
  append_number(s, x);
  return s;
}

void ErrorsLine::add(const char* key, double x, const char* unit) {
  if (std::isfinite(x) && x > 0)
    text_ += fmt::format("{}{} = \"{}{}{}\"", text_.empty() ? "" : ", ", key, number_text(x),
                         *unit == 0 ? "" : " ", unit);
}
std::string ErrorsLine::line() const { return text_.empty() ? "" : "errors = { " + text_ + " }\n"; }

const char* const kImuIncrementHeader = "t_s,dthx_rad,dthy_rad,dthz_rad,dvx_mps,dvy_mps,dvz_mps";

std::string imu_increment_section(const ErrorsLine& errors, const std::string& file) {
  return "\n[imu]\nfile = \"" + file +
         "\"\nkind = \"increment\"\naxes = \"RFU\"\ncolumns = { time = "
         "\"t_s\", gyro = [\"dthx_rad\", \"dthy_rad\", \"dthz_rad\"], accel = [\"dvx_mps\", "
         "\"dvy_mps\", \"dvz_mps\"] }\n" +
         errors.line();
}
std::string reference_section(const std::string& file) {
  return "\n[reference]\nfile = \"" + file +
         "\"\ncolumns = { time = \"t_s\", lat = \"lat_deg\", "
         "lon = \"lon_deg\", height = \"h_m\", x = \"x_m\", y = \"y_m\", z = \"z_m\", ve = "
         "\"ve_mps\", vn = \"vn_mps\", vu = \"vu_mps\", roll = \"roll_deg\", pitch = "
         "\"pitch_deg\", heading = \"heading_deg\", qw = \"qw\", qx = \"qx\", qy = \"qy\", qz = "
         "\"qz\" }\n";
}
std::string benchmark_section(const NamedBenchmark& b) {
  return fmt::format(
      "\n[[benchmark]]\nname = \"{}\"\nt_s = {}\nlat_deg = {}\nlon_deg = {}\nh_m = {}\nstd = "
      "\"{} m\"\n",
      b.name, number_text(b.point.t), number_text(b.point.lat / deg),
      number_text(b.point.lon / deg), number_text(b.point.h), number_text(b.point.std));
}

std::string start_section(double t, const Point<Ecef>& r, const Vec<Ecef>& v,
                          const Quat<Ecef, Body>& q, double position, double velocity, double level,
                          double heading) {
  const auto n = [](double x) { return number_text(x); };
  ErrorsLine errors;
  errors.add("position", position, "m");
  errors.add("velocity", velocity, "m/s");
  errors.add("level", level, "rad");
  errors.add("heading", heading, "rad");
  return fmt::format(
             "\n[start]\nstate = {{ t_s = {}, x_m = {}, y_m = {}, z_m = {}, vx_mps = {}, vy_mps = "
             "{}, vz_mps = {}, qw = {}, qx = {}, qy = {}, qz = {} }}\n",
             n(t), n(r.x), n(r.y), n(r.z), n(v.x), n(v.y), n(v.z), n(q.w), n(q.x), n(q.y), n(q.z)) +
         errors.line();
}

}  // namespace loxo
