// SPDX-License-Identifier: Apache-2.0
// `loxo transfer DRIVE -o DRIVE2`: the drive at the pole, with its own sensor errors.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "cli/transfer.hpp"
#include "loxo/log/drive.hpp"
#include "loxo/log/solution_file.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/sim/polar_mover.hpp"
#include "loxo/text/csv.hpp"

namespace loxo::cli {
namespace {

// A folder that appears whole or not at all.
class NewFolder {
 public:
  explicit NewFolder(std::string path)
      : path_(std::move(path)), aside_(path_ + ".unfinished-" + std::to_string(::getpid())) {
    if (std::filesystem::exists(path_))
      throw Error(ErrorKind::kUsage, "'" + path_ + "' is there already", "-o");
    std::error_code failed;
    std::filesystem::create_directory(aside_, failed);
    if (failed) throw Error(ErrorKind::kWork, "cannot make the folder: " + failed.message(), path_);
  }
  ~NewFolder() {
    std::error_code ignored;
    if (!done_) std::filesystem::remove_all(aside_, ignored);
  }
  std::string file(const std::string& name) const { return aside_ + "/" + name; }
  void commit() {
    std::filesystem::rename(aside_, path_);
    done_ = true;
  }

 private:
  std::string path_, aside_;
  bool done_ = false;
};

class Csv {
 public:
  Csv(const std::string& path, const std::string& header) : out_(path), text_(header + "\n") {}
  void row(std::initializer_list<double> values) {
    bool first = true;
    for (const double x : values) {
      if (!first) text_ += ',';
      append_number(text_, x);
      first = false;
    }
    text_ += '\n';
    if (text_.size() > (1u << 16)) flush();
  }
  void commit() {
    flush();
    out_.commit();
  }

 private:
  void flush() {
    out_.write(text_);
    text_.clear();
  }
  OutputFile out_;
  std::string text_;
};

std::string num(double x) {
  std::string s;
  append_number(s, x);
  return s;
}

SolutionRow row_of(const Ellipsoid& earth, double t, const EcefPose<double>& e) {
  SolutionRow r;
  r.t = t;
  const auto g = to_geodetic(earth, e.r);
  r.lat = g.lat;
  r.lon = g.lon;
  r.h = g.h;
  const auto C_ge = geographic_axes(g.lat, g.lon);
  const auto v = C_ge * e.v;
  r.ve = v.x;
  r.vn = v.y;
  r.vu = v.z;
  const auto a = to_euler(C_ge * e.C_eb);
  r.heading = a.heading;
  r.pitch = a.pitch;
  r.roll = a.roll;
  const auto q = to_quaternion(e.C_eb);
  r.qw = q.w;
  r.qx = q.x;
  r.qy = q.y;
  r.qz = q.z;
  r.x = e.r.x;
  r.y = e.r.y;
  r.z = e.r.z;
  return r;
}

// What the slow channels need of the track, once a second or at each reference epoch.
struct Along {
  double t, p, l, dp, dl, ratio;
};
Along along_at(const std::vector<Along>& track, double t) {
  const auto after = std::lower_bound(track.begin(), track.end(), t,
                                      [](const Along& a, double x) { return a.t < x; });
  if (after == track.begin()) return track.front();
  if (after == track.end()) return track.back();
  const Along &b = *after, &a = *(after - 1);
  const double u = (t - a.t) / (b.t - a.t);
  const auto mix = [u](double x, double y) { return x + u * (y - x); };
  return {t, mix(a.p, b.p), mix(a.l, b.l), mix(a.dp, b.dp), mix(a.dl, b.dl), mix(a.ratio, b.ratio)};
}

}  // namespace

int transfer_drive(const Globals& globals, const TransferOptions& o) {
  if (o.drive.empty())
    throw Error(ErrorKind::kUsage,
                "expected a drive or an operation (rates, plan); see 'loxo transfer --help'");
  if (globals.output.empty())
    throw Error(ErrorKind::kUsage, "expected -o DRIVE2, the folder of the moved drive");
  if (o.angle.empty() || o.meridian.empty())
    throw Error(ErrorKind::kUsage, "expected --angle and --meridian, with their units");
  if (o.earth != "ellipsoid" && o.earth != "sphere")
    throw Error(ErrorKind::kUsage, "expected ellipsoid or sphere, found '" + o.earth + "'",
                "--earth");
  if (!o.keep.empty() && o.keep != "path" && o.keep != "velocity")
    throw Error(ErrorKind::kUsage, "expected path or velocity, found '" + o.keep + "'", "--keep");
  const Drive drive = read_drive(o.drive, globals.sets);
  if (!drive.imu.present)
    throw Error(ErrorKind::kInput, "the drive has no [imu]: nothing to convert", o.drive);
  if (!drive.reference.present)
    throw Error(
        ErrorKind::kInput,
        "the drive has no [reference]: the conversion needs position, velocity and attitude",
        o.drive);
  if (o.earth == "sphere" && drive.ellipsoid.f > 0)
    throw Error(ErrorKind::kUsage,
                "the drive is on " + drive.ellipsoid.name +
                    "; the sphere's formulas keep path and velocity both, which is wrong there by "
                    "0.7 % of the speed and 4.6e-4 m/s^2 "
                    "in turns; use --earth ellipsoid with --keep path or velocity",
                "--earth");
  PolarMove move{drive.ellipsoid, option_quantity(o.meridian, Dimension::kAngle, "--meridian"),
                 option_quantity(o.angle, Dimension::kAngle, "--angle"),
                 o.keep == "velocity" ? Keep::kVelocity : Keep::kPath};
  if (std::fabs(move.angle) > 2 * kPi)
    throw Error(ErrorKind::kUsage, "expected an angle within -360 to 360 deg", "--angle");

  Diagnostics diagnostics = drive.diagnostics;
  const Solution reference = read_reference(drive, diagnostics);
  if (reference.rows.size() < 2)
    throw Error(ErrorKind::kInput, "the reference has fewer than two epochs", drive.reference.file);
  std::vector<double> steps;
  for (std::size_t i = 1; i < reference.rows.size(); ++i)
    steps.push_back(reference.rows[i].t - reference.rows[i - 1].t);
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2),
                   steps.end());
  const double longest = std::max(1.0, 3.5 * steps[steps.size() / 2]);

  NewFolder folder(globals.output);
  Csv imu(folder.file("imu.csv"), "t_s,dthx_rad,dthy_rad,dthz_rad,dvx_mps,dvy_mps,dvz_mps");
  SolutionWriter moved_reference(
      folder.file("reference.csv"),
      {{"mode", "moved reference"}, {"ellipsoid", drive.ellipsoid.name}});
  std::vector<Along> track;
  std::vector<std::pair<double, EcefPose<double>>> starts;
  double begin = kNone, largest_f = 0, largest_w = 0;
  std::size_t samples = 0, k = 0;
  PolarMover mover(
      move,
      [&]() -> std::optional<ReferenceEpoch> {
        if (k == reference.rows.size()) return std::nullopt;
        return reference_epoch(reference.rows[k++], drive.reference.file);
      },
      longest,
      [&](const MovedSample& s) {
        if (samples++ == 0) begin = s.imu.t - s.imu.dt;
        imu.row({s.imu.t, s.imu.dtheta.x, s.imu.dtheta.y, s.imu.dtheta.z, s.imu.dv.x, s.imu.dv.y,
                 s.imu.dv.z});
        largest_f = std::max(largest_f, norm(s.conversion.df));
        largest_w = std::max(largest_w, norm(s.conversion.dw));
      },
      [&](double t, const TransverseState<double>& home, const TransverseState<double>& moved) {
        const auto e = to_ecef_pose(move.earth, move.lon0, moved);
        moved_reference.write(row_of(move.earth, t, e));
        if (starts.size() < 100000) starts.emplace_back(t, e);
        // The wheel's share of the rescaled velocity, along the vehicle's own forward axis.
        TransverseState<double> forward = home;
        forward.v = {home.C_tb.m[0][1], home.C_tb.m[1][1], home.C_tb.m[2][1]};
        const double ratio = move.keep == Keep::kPath ? norm(move_state(move, forward).v) : 1.0;
        track.push_back({t, home.tlat, home.tlon, moved.tlat - home.tlat,
                         moved.tlon - (home.tlon - move.angle), ratio});
      });
  ImuReader reader(drive, diagnostics);
  ImuIncrement<double> u;
  while (reader.next(u)) mover.add(u);
  mover.finish();
  if (samples == 0)
    throw Error(ErrorKind::kInput, "the reference and the IMU log have no time in common", o.drive);
  const std::size_t out = mover.before() + mover.after();
  const double left_out = static_cast<double>(out) * reader.interval();
  if (left_out > 1.0 && !o.trim)
    throw Error(ErrorKind::kInput,
                fmt::format("the reference covers {} s to {} s; {} IMU samples before it and {} "
                            "after it would be left out "
                            "(--trim does so)",
                            num(mover.first_reference()), num(mover.last_reference()),
                            mover.before(), mover.after()),
                drive.reference.file);
  if (out > 0)
    diagnostics.note("trimmed", drive.reference.file,
                     fmt::format("{} IMU samples before the reference and {} after it left out",
                                 mover.before(), mover.after()));
  imu.commit();
  moved_reference.commit();

  // The start: the moved reference where the log begins.
  std::size_t first = 0;
  while (first + 1 < starts.size() && starts[first].first < begin - 1e-6) ++first;
  const auto& [t0, e0] = starts[first];
  const auto q0 = to_quaternion(e0.C_eb);
  std::string toml = fmt::format(
      "format = 1\nname = \"{} (moved by {} about the meridian {})\"\nellipsoid = \"{}\"\n",
      drive.name, o.angle, o.meridian,
      drive.ellipsoid.name == "sphere" || drive.ellipsoid.name.find('=') != std::string::npos
          ? fmt::format("a={}m,f={}", num(drive.ellipsoid.a), num(drive.ellipsoid.f))
          : drive.ellipsoid.name);
  if (drive.ellipsoid.name == "sphere" && drive.ellipsoid.g_constant > 0)
    toml.replace(toml.rfind("a="), std::string::npos, "sphere\"\n");
  toml +=
      "\n[imu]\nfile = \"imu.csv\"\nkind = \"increment\"\naxes = \"RFU\"\ncolumns = { time = "
      "\"t_s\", gyro = [\"dthx_rad\", \"dthy_rad\", "
      "\"dthz_rad\"], accel = [\"dvx_mps\", \"dvy_mps\", \"dvz_mps\"] }\n";
  std::string errors;
  const auto declare = [&](const char* key, double x, const char* unit) {
    if (std::isfinite(x))
      errors += fmt::format("{}{} = \"{} {}\"", errors.empty() ? "" : ", ", key, num(x), unit);
  };
  declare("gyro_bias", drive.imu_errors.gyro_bias, "rad/s");
  declare("gyro_noise", drive.imu_errors.gyro_noise, "rad/sqrt(s)");
  declare("accel_bias", drive.imu_errors.accel_bias, "m/s^2");
  declare("accel_noise", drive.imu_errors.accel_noise, "m/s/sqrt(s)");
  if (!errors.empty()) toml += "errors = { " + errors + " }\n";
  toml += fmt::format(
      "\n[start]\nstate = {{ t_s = {}, x_m = {}, y_m = {}, z_m = {}, vx_mps = {}, vy_mps = {}, "
      "vz_mps = {}, qw = {}, qx = {}, qy = {}, qz = "
      "{} }}\n",
      num(t0), num(e0.r.x), num(e0.r.y), num(e0.r.z), num(e0.v.x), num(e0.v.y), num(e0.v.z),
      num(q0.w), num(q0.x), num(q0.y), num(q0.z));
  toml +=
      "\n[reference]\nfile = \"reference.csv\"\ncolumns = { time = \"t_s\", lat = \"lat_deg\", lon "
      "= \"lon_deg\", height = \"h_m\", x = \"x_m\", y = \"y_m\", "
      "z = \"z_m\", ve = \"ve_mps\", vn = \"vn_mps\", vu = \"vu_mps\", roll = \"roll_deg\", pitch "
      "= \"pitch_deg\", heading = \"heading_deg\", "
      "qw = \"qw\", qx = \"qx\", qy = \"qy\", qz = \"qz\" }\n";

  if (drive.odometer.present) {
    bool speed = false;
    Csv csv(folder.file("odometer.csv"), "t_s,value");
    for (const auto& tick : read_odometer(drive, diagnostics)) {
      speed = tick.is_speed;
      csv.row({tick.t, tick.value * along_at(track, tick.t).ratio});
    }
    csv.commit();
    toml += fmt::format(
        "\n[odometer]\nfile = \"odometer.csv\"\nkind = \"{}\"\ncolumns = {{ time = \"t_s\", value "
        "= \"value\" }}\nunits = {{ value = \"{}\" }}\n"
        "lever_arm = \"{} {} {} m\"\nmounting = {{ heading = \"{} rad\", pitch = \"{} rad\" }}\n",
        speed ? "speed" : "distance", speed ? "m/s" : "m", num(drive.odometer_lever[0]),
        num(drive.odometer_lever[1]), num(drive.odometer_lever[2]),
        num(drive.odometer_mounting_heading), num(drive.odometer_mounting_pitch));
  }
  const auto moved_point = [&](double t, double lat, double lon) {
    const auto at = to_transverse(lat, lon, move.lon0);
    const Along a = along_at(track, t);
    return from_transverse(at.tlat + a.dp, at.tlon - move.angle + a.dl, move.lon0);
  };
  if (drive.fix.present) {
    Csv csv(folder.file("fix.csv"), "t_s,lat_deg,lon_deg,h_m");
    for (const auto& f : read_fixes(drive, diagnostics)) {
      const auto g = moved_point(f.t, f.lat, f.lon);
      csv.row({f.t, g.lat / deg, g.lon / deg, f.h});
    }
    csv.commit();
    toml +=
        "\n[fix]\nfile = \"fix.csv\"\ncolumns = { time = \"t_s\", lat = \"lat_deg\", lon = "
        "\"lon_deg\", height = \"h_m\" }\n";
    if (std::isfinite(drive.fix_std))
      toml += fmt::format("errors = {{ position = \"{} m\" }}\n", num(drive.fix_std));
  }
  for (const auto& b : drive.benchmarks) {
    if (!std::isfinite(b.point.t)) {
      diagnostics.warn("not_moved", b.name,
                       "a benchmark known by its row, not its time, is left out");
      continue;
    }
    const auto g = moved_point(b.point.t, b.point.lat, b.point.lon);
    toml += fmt::format(
        "\n[[benchmark]]\nname = \"{}\"\nt_s = {}\nlat_deg = {}\nlon_deg = {}\nh_m = {}\nstd = "
        "\"{} m\"\n",
        b.name, num(b.point.t), num(g.lat / deg), num(g.lon / deg), num(b.point.h),
        num(b.point.std));
  }
  for (const auto& [present, name] : {std::pair{drive.attitude.present, "attitude"},
                                      {drive.track.present, "track"},
                                      {drive.velocity.present, "velocity"},
                                      {drive.heading.present, "heading"},
                                      {drive.height.present, "height"}})
    if (present)
      diagnostics.warn("not_moved", name, "this section is not moved yet and is left out");
  OutputFile file(folder.file("drive.toml"));
  file.write(toml);
  file.commit();
  folder.commit();

  const auto c = mover.closure();
  print_diagnostics(globals, diagnostics);
  say(globals,
      fmt::format(
          "{}: {} samples moved, {} kept; correction at most {:.4g} m/s^2, {:.4g} deg/h\n"
          "reference every {:.3g} s closes on the IMU to {:.3g}\" and {:.3g} m/s rms an interval",
          globals.output, samples, move.keep == Keep::kPath ? "path" : "velocity", largest_f,
          largest_w / deg_per_h, c.interval_mean, c.attitude_rms / arcsec, c.velocity_rms));
  if (globals.json)
    print_json({{"command", "transfer"},
                {"output", globals.output},
                {"samples", samples},
                {"left_out", out},
                {"keep", move.keep == Keep::kPath ? "path" : "velocity"},
                {"df_max_mps2", largest_f},
                {"dw_max_radps", largest_w},
                {"reference_interval_s", c.interval_mean},
                {"closure_attitude_rad", c.attitude_rms},
                {"closure_velocity_mps", c.velocity_rms},
                {"diagnostics", to_json(diagnostics)}});
  return 0;
}

}  // namespace loxo::cli
