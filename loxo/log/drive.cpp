// SPDX-License-Identifier: Apache-2.0
// drive.toml: read once, checked whole. Every key that is asked for here is a key that exists;
// others are refused.
#include "loxo/log/drive.hpp"

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "loxo/log/channel.hpp"
#include "loxo/log/hdf5_file.hpp"
#include "loxo/log/table.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/gzip.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo {
namespace {

namespace fs = std::filesystem;
using enum Dimension;

[[noreturn]] void refuse(const std::string& what, const std::string& where) {
  throw Error(ErrorKind::kInput, what, where);
}

std::string one_of(const TomlTable& t, const char* key, const std::vector<std::string>& valid,
                   const std::string& otherwise) {
  const auto v = t.get_string(key);
  if (!v) return otherwise;
  for (const auto& name : valid) {
    if (*v == name) return *v;
  }
  std::string list;
  for (const auto& name : valid) list += (list.empty() ? "" : ", ") + name;
  const std::string near = nearest(*v, valid);
  refuse("expected one of " + list + ", found '" + *v + "'" +
             (near.empty() ? "" : "; did you mean '" + near + "'?"),
         t.where(key));
}

double degrees(const TomlTable& t, const char* key, double limit) {
  const double x = t.need_number(key);
  if (std::abs(x) > limit) {
    refuse("expected degrees in [-" + std::to_string(static_cast<int>(limit)) + ", " +
               std::to_string(static_cast<int>(limit)) + "], found " + std::to_string(x),
           t.where(key));
  }
  return x * deg;
}
double longitude(const TomlTable& t, const char* key) {
  const double x = degrees(t, key, 360);
  return x > kPi ? x - 2 * kPi : x <= -kPi ? x + 2 * kPi : x;
}

double sigma(const TomlTable& t, const char* key, Dimension d) {
  const auto v = t.get_quantity(key, d);
  if (!v) return loxo::kNone;
  if (*v < 0)
    refuse("expected a standard deviation of 0 or more, found a negative one", t.where(key));
  return *v;
}

void read_columns(const Drive& drive, const TomlTable& t, ChannelFile& file) {
  const auto columns = t.get_table("columns");
  const auto units = t.get_table("units");
  for (const auto& key : section_keys(drive, file.section)) {
    if (columns && columns->has(key.name)) {
      std::vector<std::string> names;
      if (key.count == 1) {
        names = {columns->need_string(key.name)};
      } else {
        names = *columns->get_strings(key.name);
        if (names.size() != key.count) {
          refuse("expected " + std::to_string(key.count) + " column names, found " +
                     std::to_string(names.size()),
                 columns->where(key.name));
        }
      }
      file.columns[key.name] = names;
    }
    if (units && units->has(key.name)) {
      const std::string unit = units->need_string(key.name);
      if (key.dimension == kNone) {
        const bool count = unit == "pulse" || unit == "pulses" || unit == "count" ||
                           unit == "counts" || unit == "tick" || unit == "ticks" || unit == "1";
        if (!count)
          refuse("expected no unit or pulses, found '" + unit + "'", units->where(key.name));
      } else {
        bool multiple = false;
        declared_unit(unit, key.dimension, units->where(key.name), multiple);
      }
      file.units[key.name] = unit;
    }
  }
}

// What every section has: file, columns, units, delay.
ChannelFile read_section(const Drive& drive, const TomlTable& t, const std::string& section) {
  ChannelFile file;
  file.present = true;
  file.section = section;
  file.where = t.where("file");
  if (const auto key = file.where.rfind(": key "); key != std::string::npos) file.where.resize(key);
  file.where += ": key " + section;
  file.file = file.named = t.need_string("file");
  if (drive.folder.empty()) {
    file.file = drive.path;  // a table of the .h5 drive
  } else {
    try {
      file.file = resolve_path(file.file, drive.folder);
    } catch (const Error& e) {
      refuse(e.what(), t.where("file"));
    }
    if (section != "reference" && !fs::exists(file.file))
      refuse("no such file: '" + file.file + "'", t.where("file"));
  }
  file.table = file.named_table = t.get_string("table").value_or("");
  if (drive.folder.empty()) file.table = section;
  file.delay = t.get_quantity("delay", kTime).value_or(0.0);
  file.rate = t.get_quantity("rate", kFrequency).value_or(loxo::kNone);
  if (file.rate <= 0) refuse("expected a rate above 0", t.where("rate"));
  if (section == "fix" || section == "reference") {
    if (const auto origin = t.get_table("origin")) {
      file.origin_lat = degrees(*origin, "lat_deg", 90);
      file.origin_lon = longitude(*origin, "lon_deg");
      file.origin_h = origin->get_number("h_m").value_or(0.0);
    }
  }
  read_columns(drive, t, file);
  return file;
}

// What the format of a section's file fixes; nothing where it is a plain table, or not there.
TableConvention fixed_by_format(const Drive& d, const TomlTable& t, const std::string& section) {
  try {
    TableConvention c = d.folder.empty()
                            ? convention_of(d.path, section)
                            : convention_of(resolve_path(t.need_string("file"), d.folder),
                                            t.get_string("table").value_or(""));
    if (c.section == section) return c;
  } catch (const Error&) {  // told when the section is read
  }
  return {};
}

void read_imu(Drive& d, const TomlTable& t) {
  const TableConvention fixed = fixed_by_format(d, t, "imu");
  const auto otherwise = [](const std::string& said, const char* usual) {
    return said.empty() ? std::string(usual) : said;
  };
  d.imu_kind = one_of(t, "kind", {"rate", "increment"}, otherwise(fixed.kind, "rate"));
  d.imu_stamp = one_of(t, "stamp", {"end", "middle", "instant"}, otherwise(fixed.stamp, "end"));
  if (d.imu_kind == "increment" && d.imu_stamp != "end") {
    refuse("increments are over (previous stamp, this stamp]: expected stamp = \"end\", found '" +
               d.imu_stamp + "'",
           t.where("stamp"));
  }
  d.imu_axes = t.get_string("axes").value_or(otherwise(fixed.axes, "RFU"));
  axes_to_rfu(d.imu_axes, t.where("axes"));
  d.imu = read_section(d, t, "imu");
  if (const auto e = t.get_table("errors")) {
    d.imu_errors.gyro_bias = sigma(*e, "gyro_bias", kAngularRate);
    d.imu_errors.gyro_noise = sigma(*e, "gyro_noise", kAngleRandomWalk);
    d.imu_errors.accel_bias = sigma(*e, "accel_bias", kAcceleration);
    d.imu_errors.accel_noise = sigma(*e, "accel_noise", kVelocityRandomWalk);
    d.imu_errors.gyro_bias_tau = sigma(*e, "gyro_bias_tau", kTime);
    d.imu_errors.accel_bias_tau = sigma(*e, "accel_bias_tau", kTime);
    d.imu_errors.gyro_scale = sigma(*e, "gyro_scale", kNone);
    d.imu_errors.gyro_misalignment = sigma(*e, "gyro_misalignment", kAngle);
    d.imu_errors.accel_scale = sigma(*e, "accel_scale", kNone);
  }
  if (const auto known = t.get_table("bias")) {
    const auto gyro = known->get_vector3("gyro", kAngularRate);
    const auto accel = known->get_vector3("accel", kAcceleration);
    for (std::size_t i = 0; i < 3; ++i) {
      if (gyro) d.imu_gyro_bias[i] = (*gyro)[i];
      if (accel) d.imu_accel_bias[i] = (*accel)[i];
    }
  }
  d.imu_gyro_range = t.get_quantity("gyro_range", kAngularRate).value_or(loxo::kNone);
  d.imu_accel_range = t.get_quantity("accel_range", kAcceleration).value_or(loxo::kNone);
}

bool is_a(const TomlTable& t, const char* key, Dimension d) {
  try {
    return t.get_quantity(key, d).has_value();
  } catch (const Error&) {
    return false;
  }
}
// Of a wheel that tells its speed, the quantisation may be that of the speed or, as of the others,
// of the way.
void read_odometer_errors(const TomlTable& e, OdometerErrors& errors, bool speed = false) {
  errors.scale_noise = sigma(e, "scale_noise", kNone);
  (speed ? errors.speed_noise : errors.noise) = sigma(e, "noise", speed ? kSpeed : kLength);
  errors.distance_noise = sigma(e, "distance_noise", kDistanceRandomWalk);
  if (speed && is_a(e, "quantisation", kSpeed))
    errors.speed_quantisation = sigma(e, "quantisation", kSpeed);
  else
    errors.quantisation = sigma(e, "quantisation", kLength);
  errors.side_slip = sigma(e, "side_slip", kAngle);
  errors.scale = sigma(e, "scale", kNone);
}
void read_attitude_errors(const TomlTable& e, AttitudeErrors& errors) {
  errors.heading_bias = sigma(e, "heading_bias", kAngle);
  errors.heading_drift = sigma(e, "heading_drift", kAngularRate);
  errors.heading_noise = sigma(e, "heading_noise", kAngleRandomWalk);
}

void read_odometer_section(Drive& d, const TomlTable& t) {
  d.odometer_kind = one_of(t, "kind", {"pulses", "counter", "distance", "speed"}, "pulses");
  d.odometer = read_section(d, t, "odometer");
  const auto& columns = d.odometer.columns;
  if (d.odometer_kind == "speed" && !columns.contains("value") &&
      !(columns.contains("east") && columns.contains("north")))
    refuse("missing; expected the column of speed, or those of east and north",
           d.odometer.where + ".columns.value");
  if (columns.contains("steering")) {
    d.wheel_base = t.need_quantity("wheel_base", kLength);
    if (!(d.wheel_base > 0)) refuse("expected a length above 0", t.where("wheel_base"));
    d.steering_offset = t.get_quantity("steering_offset", kAngle).value_or(0.0);
  }
  if (d.odometer_kind == "pulses" || d.odometer_kind == "counter") {
    d.odometer_scale = t.need_quantity("scale", kLengthPerPulse);
  } else if (t.has("scale")) {
    d.odometer_scale = t.need_quantity("scale", kNone);
  }
  if (d.odometer_scale == 0) refuse("expected a scale other than 0", t.where("scale"));
  d.odometer_wrap = t.get_number("wrap").value_or(loxo::kNone);
  if (d.odometer_wrap <= 0)
    refuse("expected the number of counts after which the counter starts again", t.where("wrap"));
  if (const auto lever = t.get_vector3("lever_arm", kLength)) {
    d.odometer_lever_given = true;
    for (std::size_t i = 0; i < 3; ++i) d.odometer_lever[i] = (*lever)[i];
  }
  if (const auto m = t.get_table("mounting")) {
    d.odometer_mounting_given = true;
    d.odometer_mounting_heading = m->get_quantity("heading", kAngle).value_or(0.0);
    d.odometer_mounting_pitch = m->get_quantity("pitch", kAngle).value_or(0.0);
  }
  if (const auto e = t.get_table("errors")) {
    read_odometer_errors(*e, d.odometer_errors, d.odometer_kind == "speed");
    if (columns.contains("steering")) read_attitude_errors(*e, d.attitude_errors);
  }
}

void read_heading_words(Drive& d, const TomlTable& t) {
  d.heading_model_given = d.heading_model_given || t.has("heading_model");
  if (t.has("heading_model")) {
    d.heading_model =
        one_of(t, "heading_model", {"independent", "mechanised"}, "independent") == "mechanised"
            ? HeadingModel::kMechanised
            : HeadingModel::kIndependent;
  }
  d.earth_rate = t.get_bool("earth_rate").value_or(d.earth_rate);
  if (t.has("heading_reference")) {
    d.heading_reference = one_of(t, "heading_reference", {"true", "grid"}, "true") == "grid"
                              ? HeadingReference::kGrid
                              : HeadingReference::kTrue;
  }
}

void read_track_section(Drive& d, const TomlTable& t) {
  d.track = read_section(d, t, "track");
  d.track_heading_is_step = d.track.columns.contains("heading_step");
  if (d.track_heading_is_step == d.track.columns.contains("heading")) {
    refuse(d.track_heading_is_step
               ? "expected heading or heading_step, found both"
               : "missing; expected the column of heading, or of heading_step for increments",
           d.track.where + ".columns.heading");
  }
  read_heading_words(d, t);
  if (const auto s = t.get_quantity("scale", kNone)) d.track_scale = *s;
  if (!(d.track_scale > 0)) refuse("expected a scale above 0", t.where("scale"));
  d.track_heading_offset = t.get_quantity("heading_offset", kAngle).value_or(0.0);
  if (const auto e = t.get_table("errors")) {
    read_odometer_errors(*e, d.odometer_errors);
    read_attitude_errors(*e, d.attitude_errors);
  }
}

void read_benchmark(Drive& d, const TomlTable& t) {
  NamedBenchmark b;
  b.name = t.get_string("name").value_or(std::to_string(d.benchmarks.size() + 1));
  const auto time = t.get_number("t_s");
  const auto row = t.get_integer("after_row");
  if (time.has_value() == row.has_value()) {
    refuse(time ? "expected t_s or after_row, found both"
                : "missing; expected t_s (seconds) or after_row (0: before the first data row)",
           t.where("t_s"));
  }
  if (time) b.point.t = *time;
  if (row) {
    if (*row < 0)
      refuse("expected 0 (before the first data row) or more, found " + std::to_string(*row),
             t.where("after_row"));
    b.point.row = static_cast<std::ptrdiff_t>(*row);
  }
  b.point.lat = degrees(t, "lat_deg", 90);
  b.point.lon = longitude(t, "lon_deg");
  b.point.h = t.get_number("h_m").value_or(0.0);
  b.point.std = sigma(t, "std", kLength);
  if (!t.has("std")) {
    b.point.std = 0;
    d.diagnostics.note("benchmark_std", t.where("std"), "no std: taken as known exactly (\"0 m\")");
  }
  b.point.std_h = sigma(t, "std_h", kLength);
  if (!t.has("std_h")) b.point.std_h = b.point.std;
  d.benchmarks.push_back(std::move(b));
}

void read_start(Drive& d, const TomlTable& t) {
  StartSection& s = d.start;
  s.present = true;
  s.t = t.get_number("t_s").value_or(loxo::kNone);
  if (t.has("lat_deg") || t.has("lon_deg")) {
    s.lat = degrees(t, "lat_deg", 90);
    s.lon = longitude(t, "lon_deg");
    s.h = t.get_number("h_m").value_or(0.0);
  } else if (t.has("h_m")) {
    s.h = t.need_number("h_m");
  }
  s.ve = t.get_number("ve_mps").value_or(loxo::kNone);
  s.vn = t.get_number("vn_mps").value_or(loxo::kNone);
  s.vu = t.get_number("vu_mps").value_or(loxo::kNone);
  if (const auto a = t.get_table("alignment")) {
    s.alignment_kind = a->need_string("kind");
    one_of(*a, "kind", {"static", "swaying", "gyrocompass", "stored", "given", "fine", "in-motion"},
           "");
    s.alignment_duration = a->get_quantity("duration", kTime).value_or(loxo::kNone);
  }
  if (const auto a = t.get_table("attitude")) {
    s.heading = a->get_quantity("heading", kAngle).value_or(loxo::kNone);
    s.pitch = a->get_quantity("pitch", kAngle).value_or(loxo::kNone);
    s.roll = a->get_quantity("roll", kAngle).value_or(loxo::kNone);
    s.heading_std = sigma(*a, "heading_std", kAngle);
    s.level_std = sigma(*a, "level_std", kAngle);
  }
  if (const auto e = t.get_table("errors")) {
    s.position_std = sigma(*e, "position", kLength);
    s.velocity_std = sigma(*e, "velocity", kSpeed);
    if (e->has("level")) s.level_std = sigma(*e, "level", kAngle);
    if (e->has("heading")) s.heading_std = sigma(*e, "heading", kAngle);
  }
  if (const auto state = t.get_table("state")) {
    s.has_state = true;
    s.state_t = state->get_number("t_s").value_or(s.t);
    s.r[0] = state->need_number("x_m");
    s.r[1] = state->need_number("y_m");
    s.r[2] = state->need_number("z_m");
    s.v[0] = state->get_number("vx_mps").value_or(0.0);
    s.v[1] = state->get_number("vy_mps").value_or(0.0);
    s.v[2] = state->get_number("vz_mps").value_or(0.0);
    s.q[0] = state->need_number("qw");
    s.q[1] = state->need_number("qx");
    s.q[2] = state->need_number("qy");
    s.q[3] = state->need_number("qz");
    const double norm = std::hypot(std::hypot(s.q[0], s.q[1]), std::hypot(s.q[2], s.q[3]));
    if (std::abs(norm - 1) > 1e-6)
      refuse("expected a unit quaternion, found one of norm " + std::to_string(norm),
             state->where("qw"));
    for (double& q : s.q) q /= norm;
    const double radius = std::hypot(std::hypot(s.r[0], s.r[1]), s.r[2]);
    if (std::abs(radius / d.ellipsoid.a - 1) > 0.1) {
      refuse("expected an ECEF position near the Earth's surface, found one " +
                 std::to_string(radius) + " m from its centre",
             state->where("x_m"));
    }
    if (!std::isfinite(s.t)) s.t = s.state_t;
  }
}

}  // namespace

std::string resolve_path(const std::string& file, const std::string& folder) {
  std::string rest;
  if (file.rfind("data:", 0) == 0) {
    rest = file.substr(5);
  } else if (file.rfind("$LOXO_DATA/", 0) == 0) {
    rest = file.substr(11);
  } else {
    const fs::path path(file);
    return path.is_absolute() || folder.empty()
               ? file
               : (fs::path(folder) / path).lexically_normal().string();
  }
  if (const char* data = std::getenv("LOXO_DATA"); data != nullptr && *data != '\0')
    return (fs::path(data) / rest).string();
  for (fs::path up = fs::absolute(folder);; up = up.parent_path()) {
    for (const char* name : {"data", "shared/data"}) {
      if (fs::exists(up / name / rest)) return (up / name / rest).string();
    }
    if (up == up.parent_path()) break;
  }
  throw Error(
      ErrorKind::kInput,
      "'" + file +
          "' was not found: set the environment variable LOXO_DATA to the folder that holds '" +
          rest.substr(0, rest.find('/')) + "'");
}

std::array<double, 9> axes_to_rfu(const std::string& axes, const std::string& where) {
  std::array<double, 9> c{};
  const std::string how =
      "expected three letters that name right/left, forward/back and up/down (R L, F B, U D), as "
      "RFU, FRD or FLU, found '" +
      axes + "'";
  if (axes.size() != 3) refuse(how, where);
  for (std::size_t j = 0; j < 3; ++j) {
    const char a = static_cast<char>(std::toupper(static_cast<unsigned char>(axes[j])));
    std::size_t i = 0;
    double sign = 1;
    switch (a) {
      case 'R':
      case 'E':
        break;
      case 'L':
      case 'W':
        sign = -1;
        break;
      case 'F':
      case 'N':
        i = 1;
        break;
      case 'B':
      case 'A':
      case 'S':
        i = 1;
        sign = -1;
        break;
      case 'U':
        i = 2;
        break;
      case 'D':
        i = 2;
        sign = -1;
        break;
      default:
        refuse(how, where);
    }
    c[3 * i + j] = sign;
  }
  const double det = c[0] * (c[4] * c[8] - c[5] * c[7]) - c[1] * (c[3] * c[8] - c[5] * c[6]) +
                     c[2] * (c[3] * c[7] - c[4] * c[6]);
  if (det == 0) refuse(how + ": an axis is named twice", where);
  if (det < 0)
    refuse("'" + axes + "' is a left-handed triple (determinant -1); an IMU has right-handed axes",
           where);
  return c;
}

bool is_drive(const std::string& path) {
  if (fs::is_directory(path) || fs::path(path).extension() == ".toml") return true;
  return fs::is_regular_file(path) && is_h5(path) && h5_text(path, "drive.toml").has_value();
}

Drive read_drive(const std::string& path, const std::vector<std::string>& sets) {
  Drive d;
  d.path = path;
  if (fs::is_directory(path)) {
    d.folder = path;
    d.toml_path = (fs::path(path) / "drive.toml").string();
    if (!fs::exists(d.toml_path))
      refuse("the folder holds no drive.toml; 'loxo inspect' proposes one for the files in it",
             path);
  } else if (!fs::exists(path)) {
    refuse(
        "no such file or folder; expected a drive: a folder with drive.toml, a .toml or a .h5 file",
        path);
  } else if (fs::path(path).extension() == ".toml") {
    d.toml_path = path;
    d.folder = fs::path(path).parent_path().string();
    if (d.folder.empty()) d.folder = ".";
  } else if (is_h5(path)) {
    const auto text = h5_text(path, "drive.toml");
    if (!text)
      refuse("an HDF5 file without the text drive.toml: no drive ('loxo inspect " + path +
                 "' tells what is in it)",
             path);
    d.toml_path = path + ":drive.toml";
    d.toml = *text;
  } else {
    refuse("is no drive; expected a folder with drive.toml, a .toml or a .h5 file ('loxo inspect " +
               path + "' proposes a drive.toml)",
           path);
  }
  if (d.toml.empty()) d.toml = read_file(d.toml_path);

  TomlTable t = TomlTable::parse(d.toml, d.toml_path);
  for (const auto& set : sets) {
    const auto equals = set.find('=');
    if (equals == std::string::npos || equals == 0)
      throw Error(ErrorKind::kUsage, "expected key=value, found '" + set + "'", "--set");
    t.set(set.substr(0, equals), set.substr(equals + 1));
  }
  const auto format = t.get_integer("format").value_or(1);
  if (format != 1)
    refuse("expected format = 1, found " + std::to_string(format), t.where("format"));
  d.name = t.get_string("name").value_or("");
  try {
    d.ellipsoid = ellipsoid_by_name(t.get_string("ellipsoid").value_or("WGS84"));
  } catch (const Error& e) {
    refuse(e.what(), t.where("ellipsoid"));
  }

  if (const auto s = t.get_table("imu")) read_imu(d, *s);
  if (const auto s = t.get_table("odometer")) read_odometer_section(d, *s);
  if (const auto s = t.get_table("attitude")) {
    d.attitude = read_section(d, *s, "attitude");
    read_heading_words(d, *s);
    if (const auto e = s->get_table("errors")) read_attitude_errors(*e, d.attitude_errors);
  }
  if (const auto s = t.get_table("track")) read_track_section(d, *s);
  for (const auto& b : t.get_tables("benchmark")) read_benchmark(d, b);
  if (const auto s = t.get_table("fix")) {
    d.fix = read_section(d, *s, "fix");
    if (const auto lever = s->get_vector3("lever_arm", kLength)) {
      for (std::size_t i = 0; i < 3; ++i) d.fix_lever[i] = (*lever)[i];
    }
    if (const auto e = s->get_table("errors")) {
      d.fix_std = sigma(*e, "position", kLength);
      d.fix_velocity_std = sigma(*e, "velocity", kSpeed);
      d.fix_lever_std = sigma(*e, "lever_arm", kLength);
    }
  }
  if (const auto s = t.get_table("velocity")) {
    d.velocity_axes = s->get_string("axes").value_or("RFU");
    axes_to_rfu(d.velocity_axes, s->where("axes"));
    d.velocity = read_section(d, *s, "velocity");
    if (const auto e = s->get_table("errors")) {
      d.velocity_std = sigma(*e, "velocity", kSpeed);
      if (!d.odometer.present) read_odometer_errors(*e, d.odometer_errors);
    }
  }
  if (const auto s = t.get_table("heading")) {
    d.heading = read_section(d, *s, "heading");
    read_heading_words(d, *s);
    const auto& columns = d.heading.columns;
    const bool positions = columns.contains("lat") && columns.contains("lon");
    if (columns.contains("heading") + columns.contains("rate") + positions != 1)
      refuse(
          "expected one of: the column of heading, of rate (a gyro about the vertical, clockwise), "
          "or those of lat and lon (the course of a recorded path)",
          d.heading.where + ".columns.heading");
    if (const auto e = s->get_table("errors")) {
      d.heading_std = sigma(*e, "heading", kAngle);
      read_attitude_errors(*e, d.attitude_errors);
    }
  }
  if (const auto s = t.get_table("height")) {
    d.height = read_section(d, *s, "height");
    if (const auto e = s->get_table("errors")) {
      d.height_std = sigma(*e, "height", kLength);
      d.height_bias = sigma(*e, "bias", kLength);
      d.height_bias_tau = sigma(*e, "bias_tau", kTime);
    }
  }
  if (const auto s = t.get_table("reference")) d.reference = read_section(d, *s, "reference");
  if (const auto s = t.get_table("start")) read_start(d, *s);
  if (!std::isfinite(d.start.lat) && !d.start.has_state && !d.benchmarks.empty()) {
    // interface.md: the default position is the first benchmark.
    const Benchmark& b = d.benchmarks.front().point;
    d.start.from_benchmark = true;
    d.start.lat = b.lat;
    d.start.lon = b.lon;
    if (!std::isfinite(d.start.h)) d.start.h = b.h;
    if (!std::isfinite(d.start.t)) d.start.t = b.t;
  }
  t.refuse_unknown();
  if (!d.imu.present && !d.track.present && !d.odometer.present && !d.attitude.present &&
      !d.fix.present && !d.velocity.present && !d.heading.present && !d.height.present &&
      !d.reference.present) {
    refuse(
        "the drive describes no data: expected [imu], [odometer], [attitude], [track] or another "
        "section of sensors",
        d.toml_path);
  }
  return d;
}

}  // namespace loxo
