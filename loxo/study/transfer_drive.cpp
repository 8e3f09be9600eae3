// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/transfer_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "loxo/log/drive_folder.hpp"
#include "loxo/log/solution_file.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/sim/moved_track.hpp"

namespace loxo {
namespace {

// Beyond this latitude a track's true heading turns too fast between two rows: it is written as a
// grid heading.
constexpr double kGridAbove = 80 * deg;

SolutionRow row_of(const Ellipsoid& earth, double t, const EcefPose<double>& e) {
  return solution_row(earth, t, e.r, e.v, to_quaternion(e.C_eb));
}

std::string toml_string(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

// The slow sensors of a drive, moved; each method writes one section's file and returns its text.
class SlowSections {
 public:
  SlowSections(const Drive& drive, const MovedTrack& track, const std::string& folder,
               Diagnostics& d)
      : drive_(drive), track_(track), folder_(folder), d_(d) {}

  std::string odometer() {
    bool speed = false;
    ChannelWriter csv(file("odometer.csv"), "t_s,value");
    each("odometer", read_odometer(drive_, d_), [&](const OdometerTick& tick) {
      speed = tick.is_speed;
      csv.row({tick.t, tick.value * track_.forward_factor(tick.t)});
    });
    csv.commit();
    std::string toml = fmt::format(
        "\n[odometer]\nfile = \"odometer.csv\"\nkind = \"{}\"\ncolumns = {{ time = \"t_s\", value "
        "= \"value\" }}\nunits = {{ value = \"{}\" }}\n",
        speed ? "speed" : "distance", speed ? "m/s" : "m");
    if (drive_.odometer_lever_given) toml += "lever_arm = " + vector(drive_.odometer_lever) + "\n";
    toml += fmt::format("mounting = {{ heading = \"{} rad\", pitch = \"{} rad\" }}\n",
                        number_text(drive_.odometer_mounting_heading),
                        number_text(drive_.odometer_mounting_pitch));
    return toml + odometer_errors().line();
  }

  std::string fix() {
    ChannelWriter csv(file("fix.csv"),
                      "t_s,lat_deg,lon_deg,h_m,ve_mps,vn_mps,vu_mps,std_e_m,std_n_m,std_u_m,"
                      "std_v_mps");
    bool height = false, velocity = false, up = false, std = false, std_v = false;
    each("fix", read_fixes(drive_, d_), [&](const Fix& f) {
      const Geodetic<double> home{f.lat, f.lon, std::isfinite(f.h) ? f.h : 0.0};
      const auto g = track_.point(f.t, home);
      const bool moves = std::isfinite(f.ve) && std::isfinite(f.vn);
      const auto v =
          moves ? track_.velocity(f.t, home, {f.ve, f.vn, std::isfinite(f.vu) ? f.vu : 0.0})
                : Vec<Geographic, double>{kNone, kNone, kNone};
      // The axes turn by the change of convergence, and the variances with them.
      const double turn = track_.heading(f.t, 0.0), s = std::sin(turn), c = std::cos(turn);
      const double e2 = f.std_e * f.std_e, n2 = f.std_n * f.std_n;
      csv.row({f.t, g.lat / deg, g.lon / deg, f.h, v.x, v.y, std::isfinite(f.vu) ? v.z : kNone,
               std::sqrt(e2 * c * c + n2 * s * s), std::sqrt(n2 * c * c + e2 * s * s), f.std_u,
               f.std_v});
      height = height || std::isfinite(f.h);
      velocity = velocity || moves;
      up = up || (moves && std::isfinite(f.vu));
      std = std || f.std_e > 0 || f.std_n > 0;
      std_v = std_v || f.std_v > 0;
    });
    csv.commit();
    std::string columns = "time = \"t_s\", lat = \"lat_deg\", lon = \"lon_deg\"";
    if (height) columns += ", height = \"h_m\"";
    if (velocity) columns += ", ve = \"ve_mps\", vn = \"vn_mps\"";
    if (up) columns += ", vu = \"vu_mps\"";
    if (std) columns += ", std_e = \"std_e_m\", std_n = \"std_n_m\"";
    if (std && height) columns += ", std_u = \"std_u_m\"";
    if (std_v) columns += ", std_v = \"std_v_mps\"";
    std::string toml = "\n[fix]\nfile = \"fix.csv\"\ncolumns = { " + columns + " }\n";
    if (drive_.fix_lever[0] != 0 || drive_.fix_lever[1] != 0 || drive_.fix_lever[2] != 0)
      toml += "lever_arm = " + vector(drive_.fix_lever) + "\n";
    ErrorsLine errors;
    errors.add("position", drive_.fix_std, "m");
    errors.add("velocity", drive_.fix_velocity_std, "m/s");
    errors.add("lever_arm", drive_.fix_lever_std, "m");
    return toml + errors.line();
  }

  std::string attitude() {
    ChannelWriter csv(file("attitude.csv"), "t_s,heading_deg,pitch_deg,roll_deg");
    each("attitude", read_attitude(drive_, d_), [&](const AttitudeSample& a) {
      csv.row({a.t, track_.heading(a.t, a.heading) / deg, a.pitch / deg, a.roll / deg});
    });
    csv.commit();
    return "\n[attitude]\nfile = \"attitude.csv\"\ncolumns = { time = \"t_s\", heading = "
           "\"heading_deg\", pitch = \"pitch_deg\", roll = \"roll_deg\" }\n" +
           attitude_errors().line();
  }

  // Distances and headings of the way; `rows` keeps when each row ended, for benchmarks by row.
  std::string track(const std::vector<TrackStep>& steps) {
    if (drive_.heading_model == HeadingModel::kMechanised) {
      d_.warn("not_moved", "track",
              "a mechanised heading carries the transport rate of its own reckoned place (V-42), "
              "which another place does not have: left out");
      return "";
    }
    const bool home_grid = drive_.heading_reference == HeadingReference::kGrid;
    bool grid = home_grid;
    for (const TrackStep& s : steps)
      grid = grid || std::fabs(track_.point(s.t, track_.home_point(s.t)).lat) > kGridAbove;
    ChannelWriter csv(file("track.csv"), "t_s,ds_m,heading_deg,pitch_deg,h_m");
    double last = kNone;
    each("track", steps, [&](const TrackStep& s) {
      const double mid = std::isfinite(last) ? 0.5 * (last + s.t) : s.t;
      last = s.t;
      const auto home = track_.home_point(mid), moved = track_.point(mid, home);
      const double psi = s.heading + (home_grid ? grid_angle(home) : 0.0);
      const double heading = track_.heading(mid, psi) - (grid ? grid_angle(moved) : 0.0);
      csv.row({s.t, s.ds * track_.distance_factor(mid, psi),
               (heading - 2 * kPi * std::floor(heading / (2 * kPi))) / deg, s.pitch / deg, s.h});
    });
    csv.commit();
    ErrorsLine errors = odometer_errors();
    return fmt::format(
               "\n[track]\nfile = \"track.csv\"\ncolumns = {{ time = \"t_s\", distance = \"ds_m\", "
               "heading = \"heading_deg\", pitch = \"pitch_deg\", height = \"h_m\" }}\n"
               "heading_model = \"independent\"\nheading_reference = \"{}\"\n",
               grid ? "grid" : "true") +
           attitude_errors(errors).line();
  }

  std::string velocity() {
    bool level = false;
    const auto samples = read_velocities(drive_, d_);
    for (const auto& s : samples) level = level || s.level;
    ChannelWriter csv(file("velocity.csv"),
                      level ? "t_s,ve_mps,vn_mps,vu_mps" : "t_s,right_mps,forward_mps,up_mps");
    bool third = false, across = false;
    each("velocity", samples, [&](const VelocitySample& s) {
      const auto some = [](double x) { return std::isfinite(x) ? x : 0.0; };
      double v[3];
      if (s.level) {
        const auto m = track_.velocity(s.t, track_.home_point(s.t),
                                       {some(s.v[0]), some(s.v[1]), some(s.v[2])});
        v[0] = m.x, v[1] = m.y, v[2] = m.z;
        across = true;
      } else {
        const auto m =
            track_.velocity(s.t, Vec<Body, double>{some(s.v[0]), some(s.v[1]), some(s.v[2])});
        v[0] = std::isfinite(s.v[0]) ? m.x : kNone;
        v[1] = std::isfinite(s.v[1]) ? m.y : kNone;
        v[2] = m.z;
        across = across || std::isfinite(s.v[0]);
      }
      third = third || std::isfinite(s.v[2]);
      csv.row({s.t, v[0], v[1], std::isfinite(s.v[2]) ? v[2] : kNone});
    });
    csv.commit();
    std::string columns = "time = \"t_s\"";
    if (level) {
      columns += ", east = \"ve_mps\", north = \"vn_mps\"";
    } else {
      if (across) columns += ", right = \"right_mps\"";
      columns += ", forward = \"forward_mps\"";
    }
    if (third) columns += level ? ", up = \"vu_mps\"" : ", up = \"up_mps\"";
    ErrorsLine errors;
    errors.add("velocity", drive_.velocity_std, "m/s");
    return "\n[velocity]\nfile = \"velocity.csv\"\ncolumns = { " + columns + " }\n" + errors.line();
  }

  std::string heading() {
    ChannelWriter csv(file("heading.csv"), "t_s,heading_deg,std_deg");
    bool std = false;
    each("heading", read_headings(drive_, d_), [&](const HeadingSample& s) {
      csv.row({s.t, track_.heading(s.t, s.heading) / deg, s.std / deg});
      std = std || s.std > 0;
    });
    csv.commit();
    ErrorsLine errors;
    errors.add("heading", drive_.heading_std, "rad");
    if (!drive_.attitude.present && !drive_.track.present) errors = attitude_errors(errors);
    return std::string(
               "\n[heading]\nfile = \"heading.csv\"\ncolumns = { time = \"t_s\", heading "
               "= \"heading_deg\"") +
           (std ? ", std = \"std_deg\"" : "") + " }\n" + errors.line();
  }

  std::string height() {
    ChannelWriter csv(file("height.csv"), "t_s,h_m,vu_mps");
    bool rate = false;
    each("height", read_heights(drive_, d_), [&](const HeightSample& s) {
      csv.row({s.t, s.h, s.rate});
      rate = rate || std::isfinite(s.rate);
    });
    csv.commit();
    ErrorsLine errors;
    errors.add("height", drive_.height_std, "m");
    errors.add("bias", drive_.height_bias, "m");
    errors.add("bias_tau", drive_.height_bias_tau, "s");
    return std::string(
               "\n[height]\nfile = \"height.csv\"\ncolumns = { time = \"t_s\", height = \"h_m\"") +
           (rate ? ", rate = \"vu_mps\"" : "") + " }\n" + errors.line();
  }

 private:
  std::string file(const char* name) const { return folder_ + "/" + name; }
  static std::string vector(const double v[3]) {
    return fmt::format("\"{} {} {} m\"", number_text(v[0]), number_text(v[1]), number_text(v[2]));
  }
  // True heading = grid heading + this: the longitude in the north, its opposite in the south.
  static double grid_angle(const Geodetic<double>& g) { return g.lat < 0 ? -g.lon : g.lon; }
  ErrorsLine odometer_errors() const {
    ErrorsLine e;
    e.add("scale_noise", drive_.odometer_errors.scale_noise, "");
    e.add("noise", drive_.odometer_errors.noise, "m");
    e.add("distance_noise", drive_.odometer_errors.distance_noise, "m/sqrt(m)");
    e.add("quantisation", drive_.odometer_errors.quantisation, "m");
    e.add("side_slip", drive_.odometer_errors.side_slip, "rad");
    e.add("scale", drive_.odometer_errors.scale, "");
    return e;
  }
  ErrorsLine attitude_errors(ErrorsLine e = {}) const {
    e.add("heading_bias", drive_.attitude_errors.heading_bias, "rad");
    e.add("heading_drift", drive_.attitude_errors.heading_drift, "rad/s");
    e.add("heading_noise", drive_.attitude_errors.heading_noise, "rad/sqrt(s)");
    return e;
  }
  // Every sample that the reference covers; the others are counted and told.
  template <class Samples, class F>
  void each(const char* section, const Samples& samples, F use) {
    std::size_t outside = 0;
    for (const auto& s : samples) {
      if (track_.covers(s.t))
        use(s);
      else
        ++outside;
    }
    if (outside == samples.size() && outside > 0)
      throw Error(ErrorKind::kInput, "no row of it lies in the time of the reference", section);
    if (outside > 0)
      d_.warn("uncovered", section,
              std::to_string(outside) + " rows outside the reference's time left out");
  }

  const Drive& drive_;
  const MovedTrack& track_;
  const std::string& folder_;
  Diagnostics& d_;
};

std::string moved_state(double t, const EcefPose<double>& e, const StartSection& s) {
  return start_section(t, e.r, e.v, to_quaternion(e.C_eb), s.position_std, s.velocity_std,
                       s.level_std, s.heading_std);
}

// The drive's own start, moved, with its own errors; nothing where it has none that can be moved.
std::string own_start(const Drive& drive, const MovedTrack& track) {
  const StartSection& s = drive.start;
  if (s.has_state) {
    EcefPose<double> e;
    e.r = {s.r[0], s.r[1], s.r[2]};
    e.v = {s.v[0], s.v[1], s.v[2]};
    e.C_eb = to_matrix(Quat<Ecef, Body, double>{s.q[0], s.q[1], s.q[2], s.q[3]});
    return moved_state(s.state_t, track.pose(s.state_t, e), s);
  }
  if (!std::isfinite(s.t) || !std::isfinite(s.lat) || !std::isfinite(s.heading) ||
      !track.covers(s.t))
    return "";
  const Geodetic<double> home{s.lat, s.lon, std::isfinite(s.h) ? s.h : 0.0};
  const auto g = track.point(s.t, home);
  if (s.alignment_kind || !std::isfinite(s.pitch) || !std::isfinite(s.roll)) {
    // Levelling at the pole is possible: gravity is there as well.
    std::string toml =
        fmt::format("\n[start]\nt_s = {}\nlat_deg = {}\nlon_deg = {}\nh_m = {}\n", number_text(s.t),
                    number_text(g.lat / deg), number_text(g.lon / deg), number_text(g.h));
    if (s.alignment_kind)
      toml +=
          fmt::format("alignment = {{ kind = \"{}\"{} }}\n", *s.alignment_kind,
                      std::isfinite(s.alignment_duration)
                          ? fmt::format(", duration = \"{} s\"", number_text(s.alignment_duration))
                          : "");
    std::string attitude =
        fmt::format("heading = \"{} rad\"", number_text(track.heading(s.t, s.heading)));
    const auto add = [&](const char* key, double x) {
      if (std::isfinite(x)) attitude += fmt::format(", {} = \"{} rad\"", key, number_text(x));
    };
    add("pitch", s.pitch);
    add("roll", s.roll);
    add("heading_std", s.heading_std);
    add("level_std", s.level_std);
    ErrorsLine errors;  // those of the attitude stand with it
    errors.add("position", s.position_std, "m");
    errors.add("velocity", s.velocity_std, "m/s");
    return toml + "attitude = { " + attitude + " }\n" + errors.line();
  }
  EcefPose<double> e;
  const auto axes = transpose(geographic_axes(s.lat, s.lon));
  const auto some = [](double x) { return std::isfinite(x) ? x : 0.0; };
  e.r = to_ecef(drive.ellipsoid, home);
  e.v = axes * Vec<Geographic, double>{some(s.ve), some(s.vn), some(s.vu)};
  e.C_eb = axes * to_matrix<Geographic>(Euler<double>{s.heading, s.pitch, s.roll});
  return moved_state(s.t, track.pose(s.t, e), s);
}

std::string ellipsoid_text(const Ellipsoid& e) {
  if (e.name == "sphere")
    return e.g_constant > 0 ? "sphere" : fmt::format("a={}m,f=0", number_text(e.a));
  if (e.name.find('=') != std::string::npos)
    return fmt::format("a={}m,f={}", number_text(e.a), number_text(e.f));
  return e.name;
}

}  // namespace

ReferenceEpochs reference_epochs(const Drive& drive, Diagnostics& diagnostics) {
  if (!drive.reference.present)
    throw Error(
        ErrorKind::kInput,
        "the drive has no [reference]: the conversion needs position, velocity and attitude",
        drive.path);
  ReferenceEpochs out;
  std::vector<double> steps;
  for (const SolutionRow& row : read_reference(drive, diagnostics).rows) {
    if (std::fabs(row.lat) > 0.5 * kPi + 1e-12)
      throw Error(ErrorKind::kInput,
                  fmt::format("expected a latitude within -90 to 90 deg, found {} at {} s",
                              number_text(row.lat / deg), number_text(row.t)),
                  drive.reference.file);
    const auto place = to_ecef(
        drive.ellipsoid, Geodetic<double>{row.lat, row.lon, std::isfinite(row.h) ? row.h : 0});
    const double apart = norm(place - Point<Ecef, double>{row.x, row.y, row.z});
    if (apart > 1.0)
      throw Error(ErrorKind::kInput,
                  fmt::format("latitude and longitude stand {:.3g} m from x, y, z at {} s", apart,
                              number_text(row.t)),
                  drive.reference.file);
    out.epochs.push_back(reference_epoch(row, drive.reference.file));
    if (out.epochs.size() > 1) steps.push_back(row.t - out.epochs[out.epochs.size() - 2].t);
  }
  if (out.epochs.size() < 2)
    throw Error(ErrorKind::kInput, "the reference has fewer than two epochs", drive.reference.file);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  out.longest_gap = std::max(1.0, 3.5 * *middle);
  return out;
}

TransferPoints transfer_points(const Drive& drive, const PolarMove& move, Diagnostics& diagnostics,
                               std::size_t most) {
  const auto epochs = reference_epochs(drive, diagnostics).epochs;
  const double span = epochs.back().t - epochs.front().t;
  TransferPoints out;
  out.step = std::max(span / static_cast<double>(epochs.size() - 1),
                      span / static_cast<double>(std::max<std::size_t>(most, 2)));
  double due = epochs.front().t;
  for (const ReferenceEpoch& k : epochs) {
    if (k.t < due - 0.5 * out.step) continue;
    due += out.step;
    const auto s = to_transverse_state(move.earth, move.lon0, k.e);
    const auto a = to_euler(s.C_tb);
    TransferPoint p;
    p.tlat = s.tlat, p.tlon = s.tlon, p.angle = move.angle;
    p.ve = s.v.x, p.vn = s.v.y;
    p.heading = a.heading, p.pitch = a.pitch, p.roll = a.roll;
    set_gravity(move.earth, p, s.h);
    out.points.push_back(p);
  }
  return out;
}

TransferResult transfer_drive(const Drive& drive, const TransferSettings& settings,
                              const std::string& folder, Diagnostics& diagnostics,
                              const std::function<void(double)>& progress) {
  const PolarMove& move = settings.move;
  if (drive.odometer.present && !drive.odometer_mounting_given)
    throw Error(ErrorKind::kInput,
                "missing; the wheel's distance is moved along its own direction: expected mounting "
                "= { heading = \"0 deg\", pitch = \"0 deg\" } with the angles in use (on the "
                "command line: --set 'odometer.mounting.heading=\"0 deg\"')",
                drive.odometer.where + ".mounting");
  const ReferenceEpochs reference = reference_epochs(drive, diagnostics);
  TransferResult out;
  MovedTrack track(move);
  std::vector<TrackStep> steps;
  const std::string imu_file = settings.binary ? "imu.h5" : "imu.csv",
                    reference_file = settings.binary ? "reference.h5" : "reference.csv";
  SolutionWriter moved_reference(
      folder + "/" + reference_file,
      {{"mode", "moved reference"}, {"ellipsoid", drive.ellipsoid.name}});
  std::vector<ChannelWriter> imu;  // none or one
  if (drive.imu.present) imu.emplace_back(folder + "/" + imu_file, kImuIncrementHeader);
  double begin = kNone;
  std::size_t k = 0;
  PolarMover mover(
      move,
      [&]() -> std::optional<ReferenceEpoch> {
        if (k == reference.epochs.size()) return std::nullopt;
        return reference.epochs[k++];
      },
      reference.longest_gap,
      [&](const MovedSample& s) {
        if (out.samples++ == 0) begin = s.imu.t - s.imu.dt;
        const auto &a = s.imu.dtheta, &b = s.imu.dv;
        imu.front().row({s.imu.t, a.x, a.y, a.z, b.x, b.y, b.z});
        out.largest_df = std::max(out.largest_df, norm(s.conversion.df));
        out.largest_dw = std::max(out.largest_dw, norm(s.conversion.dw));
        if (progress) progress(s.imu.t);
      },
      [&](double t, const TransverseState<double>& home, const TransverseState<double>& moved) {
        moved_reference.write(row_of(move.earth, t, to_ecef_pose(move.earth, move.lon0, moved)));
        track.add(t, home, moved);
        ++out.reference_epochs;
      });
  double interval = 0;
  if (drive.imu.present) {
    ImuReader reader(drive, diagnostics);
    interval = reader.interval();
    if (!reader.unit_fault().empty()) throw Error(ErrorKind::kInput, reader.unit_fault());
    ImuIncrement<double> u;
    while (reader.next(u)) mover.add(u);
  }
  mover.finish();
  if (drive.imu.present && out.samples == 0)
    throw Error(ErrorKind::kInput, "the reference and the IMU log have no time in common",
                drive.path);
  out.left_out = mover.before() + mover.after();
  if (static_cast<double>(out.left_out) * interval > 1.0 && !settings.trim)
    throw Error(ErrorKind::kInput,
                fmt::format("the reference covers {} s to {} s; {} IMU samples before it and {} "
                            "after it would be left out (--trim does so)",
                            number_text(mover.first_reference()),
                            number_text(mover.last_reference()), mover.before(), mover.after()),
                drive.reference.file);
  if (out.left_out > 0)
    diagnostics.note("trimmed", drive.reference.file,
                     fmt::format("{} IMU samples before the reference and {} after it left out",
                                 mover.before(), mover.after()));
  for (auto& writer : imu) writer.commit();
  moved_reference.commit();
  out.closure = mover.closure();
  // A sample's begin, its end less its length, misses the epoch it stands on by a rounding.
  out.begin_t =
      std::isfinite(begin) ? std::max(begin, mover.first_reference()) : mover.first_reference();
  out.end_t = mover.last_reference();

  std::string toml = fmt::format(
      "format = 1\nname = \"{} (moved by {} about the meridian {})\"\nellipsoid = \"{}\"\n",
      toml_string(drive.name), settings.angle_text, settings.meridian_text,
      ellipsoid_text(drive.ellipsoid));
  if (drive.imu.present) {
    ErrorsLine errors;
    const ImuErrors& e = drive.imu_errors;
    errors.add("gyro_bias", e.gyro_bias, "rad/s");
    errors.add("gyro_noise", e.gyro_noise, "rad/sqrt(s)");
    errors.add("accel_bias", e.accel_bias, "m/s^2");
    errors.add("accel_noise", e.accel_noise, "m/s/sqrt(s)");
    errors.add("gyro_bias_tau", e.gyro_bias_tau, "s");
    errors.add("accel_bias_tau", e.accel_bias_tau, "s");
    errors.add("gyro_scale", e.gyro_scale, "");
    errors.add("accel_scale", e.accel_scale, "");
    errors.add("gyro_misalignment", e.gyro_misalignment, "rad");
    toml += imu_increment_section(errors, imu_file);
  }
  std::string start = own_start(drive, track);
  if (start.empty() && drive.imu.present) {
    std::size_t first = 0;
    while (first + 1 < reference.epochs.size() && reference.epochs[first].t < out.begin_t - 1e-6)
      ++first;
    const ReferenceEpoch& epoch = reference.epochs[first];
    start = moved_state(epoch.t, track.pose(epoch.t, epoch.e), {});
    diagnostics.note("start", drive.path,
                     fmt::format("the moved drive starts from the moved reference at {} s: the "
                                 "drive's own start gives no attitude that could be moved",
                                 number_text(epoch.t)));
  }
  toml += start + reference_section(reference_file);
  SlowSections slow(drive, track, folder, diagnostics);
  if (drive.odometer.present) toml += slow.odometer();
  if (drive.attitude.present) toml += slow.attitude();
  if (drive.track.present) {
    steps = read_track(drive, diagnostics);
    toml += slow.track(steps);
  }
  if (drive.fix.present) toml += slow.fix();
  if (drive.velocity.present) toml += slow.velocity();
  if (drive.heading.present) toml += slow.heading();
  if (drive.height.present) toml += slow.height();
  for (const NamedBenchmark& b : drive.benchmarks) {
    NamedBenchmark moved = b;
    if (!std::isfinite(b.point.t)) {
      // By row: the time at which that row ended; before the first, where the reference begins.
      const auto row = static_cast<std::uint32_t>(std::max<std::ptrdiff_t>(b.point.row, 0));
      const auto at = std::find_if(steps.begin(), steps.end(),
                                   [&](const TrackStep& s) { return s.row >= row; });
      if (row == 0)
        moved.point.t = out.begin_t;
      else if (at != steps.end())
        moved.point.t = at->t;
      else {
        diagnostics.warn("not_moved", b.name,
                         "a benchmark known by its row, which no [track] holds: left out");
        continue;
      }
    }
    if (!track.covers(moved.point.t)) {
      diagnostics.warn("not_moved", b.name,
                       "a benchmark outside the time of the reference is left out");
      continue;
    }
    const auto g = track.point(moved.point.t, {b.point.lat, b.point.lon, b.point.h});
    moved.point.lat = g.lat;
    moved.point.lon = g.lon;
    toml += benchmark_section(moved);
  }
  OutputFile text(folder + "/drive.toml");
  text.write(toml);
  text.commit();
  return out;
}

}  // namespace loxo
