// SPDX-License-Identifier: Apache-2.0
// Drives made of the exact increments of a motion in closed form, as files, and what
// `loxo navigate --mode inertial` makes of them.
#pragma once
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "loxo/ins/closed_form_truth.hpp"
#include "loxo/num/units.hpp"
#include "program.hpp"

namespace loxo::testing {

namespace fs = std::filesystem;

inline constexpr double kStep = 0.05;  // s

struct DriveSpec {
  std::string imu_extra, start, more;  // "" start: the exact state
  long hole_from = -1, hole_samples = 0;
};

inline std::string number_text(double x) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", x);
  return text;
}

inline fs::path write_drive(const std::string& name, const truth::Motion& m, long samples,
                            const DriveSpec& spec = {}) {
  const fs::path folder = fs::path(scratch_folder()) / name;
  fs::create_directories(folder);
  std::ofstream imu(folder / "imu.csv");
  imu << "t_s,dx,dy,dz,vx,vy,vz\n";
  long i = 0;
  for (const auto& s : m.record(kStep, samples)) {
    const bool lost = i >= spec.hole_from && i < spec.hole_from + spec.hole_samples;
    ++i;
    if (lost) continue;
    imu << number_text(s.t);
    for (double x : {s.dtheta.x, s.dtheta.y, s.dtheta.z, s.dv.x, s.dv.y, s.dv.z})
      imu << ',' << number_text(x);
    imu << '\n';
  }
  std::ofstream toml(folder / "drive.toml");
  toml << "format = 1\nname = \"" << name
       << "\"\n[imu]\nfile = \"imu.csv\"\nkind = \"increment\"\nstamp = \"end\"\n"
       << "axes = \"RFU\"\ncolumns = { time = \"t_s\", gyro = [\"dx\", \"dy\", \"dz\"], accel = "
          "[\"vx\", \"vy\", \"vz\"] }\n"
       << "units = { gyro = \"rad\", accel = \"m/s\" }\n"
       << spec.imu_extra << spec.more;
  if (spec.start == "none") return folder;
  toml << "[start]\n";
  if (!spec.start.empty()) {
    toml << spec.start;
    return folder;
  }
  const auto s = m.at(0).state;
  toml << "state = { t_s = 0";
  const std::pair<const char*, double> values[] = {
      {"x_m", s.r.x},    {"y_m", s.r.y},   {"z_m", s.r.z},   {"vx_mps", s.v.x}, {"vy_mps", s.v.y},
      {"vz_mps", s.v.z}, {"qw", s.q_eb.w}, {"qx", s.q_eb.x}, {"qy", s.q_eb.y},  {"qz", s.q_eb.z}};
  for (const auto& [key, value] : values) {
    std::string text = number_text(value);
    if (text.find_first_of(".e") == std::string::npos) text += ".0";
    toml << ", " << key << " = " << text;
  }
  toml << " }\n";
  return folder;
}

inline truth::Motion over_the_pole(double seconds, double speed) {
  auto m = truth::great_circle(wgs84(), 90 * deg, 25 * deg, 0, speed);
  m.arc0 = -0.5 * seconds * m.rate;
  m.roll = 2 * deg, m.pitch = 1 * deg, m.yaw = 1 * deg;
  return m;
}

struct Ran {
  int code = -1;
  std::string err, out;
  std::map<std::string, std::vector<std::string>> table;
  std::string text;
};
inline Ran navigate(const fs::path& folder, const std::string& arguments) {
  const std::string solution = (folder / "solution.csv").string();
  fs::remove(solution);
  const auto o =
      run("navigate " + folder.string() + " --mode inertial -o " + solution + " " + arguments);
  Ran r{o.exit_code, o.err, o.out, {}, slurp(solution)};
  r.table = columns(r.text);
  return r;
}
inline double end_error(const Ran& r, const truth::Motion& m) {
  if (r.table.count("t_s") == 0 || r.table.at("t_s").empty()) return kNone;
  auto last = [&](const char* name) { return number(r.table.at(name).back()); };
  const auto s = m.at(last("t_s")).state;
  return std::hypot(last("x_m") - s.r.x, last("y_m") - s.r.y, last("z_m") - s.r.z);
}

}  // namespace loxo::testing
