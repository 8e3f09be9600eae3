// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/reckon_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/earth/angle.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/log/solution_file.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/json.hpp"

namespace loxo {
namespace {

// Above it a true heading turns faster than a log says; told, not refused (vehicle.md 1.4).
constexpr double kNearPole = 89.9 * deg;
// A step this many times the usual one is a gap in the log.
constexpr double kGapSteps = 5.0;

double number_of(const Json& j, const char* key, const std::string& path) {
  if (!j.contains(key))
    throw Error(ErrorKind::kInput,
                "missing; expected k and eps_deg, at the top or under result, as 'loxo calibrate "
                "-o' writes them",
                path + ": key " + key);
  if (!j.at(key).is_number())
    throw Error(ErrorKind::kInput, "expected a number, found " + j.at(key).dump(),
                path + ": key " + key);
  const double x = j.at(key).get<double>();
  if (!std::isfinite(x)) throw Error(ErrorKind::kInput, "not finite", path + ": key " + key);
  return x;
}

std::string text_of(const Json& j, const char* key) {
  return j.is_object() && j.contains(key) && j.at(key).is_string() ? j.at(key).get<std::string>()
                                                                   : std::string();
}

// The three ways a log is integrated, side by side: only the one that the drive declares moves.
class Reckoner {
 public:
  Reckoner(const Drive& drive, const ReckonOptions& options, HeadingModel model, double lat,
           double lon)
      : ell_(drive.ellipsoid),
        integrator_(options.integrator),
        k_(options.calibration.k),
        eps_(options.calibration.eps),
        grid_(drive.heading_reference == HeadingReference::kGrid),
        mechanised_(!grid_ && model == HeadingModel::kMechanised),
        north_(lat >= 0),
        lat_(lat),
        lon_(lon) {
    track_ = reckon_start(lat, lon);
    pair_ = mechanised_start(lat, lon);
    normal_ = grid_start(lat, lon);
  }

  // ds: level distance as recorded; dt 0 leaves the Earth-rate term out.
  void step(double ds, double heading, double h, double dt) {
    if (grid_) {
      const double g = heading - eps_;
      step_grid(ell_, north_, normal_, ds / k_, g, h);
      latlon_of_normal(normal_.n, lat_, lon_);
      heading_ = north_ ? g + lon_ : g - lon_;
    } else if (mechanised_) {
      heading_ = step_mechanised(ell_, pair_, ds, heading, k_, eps_, h, dt);
      lat_ = pair_.truth.lat, lon_ = pair_.truth.lon;
    } else {
      heading_ = heading - eps_;  // (V-5), the navigator's way
      double s, c;
      sincos(heading_, s, c);
      step_by(ell_, integrator_, track_, ds / k_ * c, ds / k_ * s, h);
      lat_ = track_.lat, lon_ = track_.lon;
    }
  }
  double lat() const { return lat_; }
  double lon() const { return wrap_pi(lon_); }
  double heading() const { return heading_; }
  bool grid() const { return grid_; }

 private:
  Ellipsoid ell_;
  Integrator integrator_;
  double k_, eps_;
  bool grid_, mechanised_, north_;
  ReckonState<> track_;
  MechanisedState<> pair_;
  GridState<> normal_;
  double lat_, lon_, heading_ = 0;
};

// The body's attitude at ascending times; none where no sensor tells it.
class BodyAttitude {
 public:
  explicit BodyAttitude(std::vector<AttitudeSample> rows) : rows_(std::move(rows)) {}
  bool known() const { return rows_.size() > 1; }
  AttitudeSample at(double t) {
    while (j_ + 2 < rows_.size() && rows_[j_ + 1].t <= t) ++j_;
    const AttitudeSample &a = rows_[j_], &b = rows_[j_ + 1];
    const double u = std::clamp((t - a.t) / (b.t - a.t), 0.0, 1.0);
    return {t, a.heading + u * wrap_pi(b.heading - a.heading), a.pitch + u * (b.pitch - a.pitch),
            a.roll + u * wrap_pi(b.roll - a.roll)};
  }

 private:
  std::vector<AttitudeSample> rows_;
  std::size_t j_ = 0;
};

double usual_step(const std::vector<TrackStep>& steps) {
  std::vector<double> dt;
  for (std::size_t i = 1; i < steps.size(); ++i)
    if (steps[i].t > steps[i - 1].t) dt.push_back(steps[i].t - steps[i - 1].t);
  if (dt.empty()) return 0;
  const auto middle = dt.begin() + static_cast<std::ptrdiff_t>(dt.size() / 2);
  std::nth_element(dt.begin(), middle, dt.end());
  return *middle;
}

struct StartPoint {
  double lat, lon, h;
};
StartPoint start_of(const Drive& drive) {
  const StartSection& s = drive.start;
  if (std::isfinite(s.lat) && std::isfinite(s.lon))
    return {s.lat, s.lon, std::isfinite(s.h) ? s.h : 0.0};
  if (s.has_state) {
    const auto g = to_geodetic(drive.ellipsoid, Point<Ecef>{s.r[0], s.r[1], s.r[2]});
    return {g.lat, g.lon, g.h};
  }
  throw Error(ErrorKind::kInput,
              "no start position: expected lat_deg and lon_deg in [start], or a [[benchmark]]",
              drive.toml_path);
}

}  // namespace

ReckonCalibration read_calibration(const std::string& path) {
  const Json file = read_json(path);
  const Json* j = &file;
  std::string where = path;
  if (file.is_object() && !file.contains("k")) {
    if (file.contains("result")) {
      j = &file.at("result");
    } else if (file.contains("methods") && !text_of(file, "recommended").empty()) {
      const std::string name = text_of(file, "recommended");
      if (!file.at("methods").is_object() || !file.at("methods").contains(name))
        throw Error(ErrorKind::kInput, "the recommended method '" + name + "' is not in it",
                    path + ": key methods");
      j = &file.at("methods").at(name);
    }
    if (j->is_object() && !j->contains("k") && j->contains("methods") &&
        !text_of(*j, "recommended").empty() &&
        j->at("methods").contains(text_of(*j, "recommended")))
      j = &j->at("methods").at(text_of(*j, "recommended"));
  }
  if (!j->is_object())
    throw Error(ErrorKind::kInput, "expected a certificate, a JSON object with k and eps_deg",
                path);
  ReckonCalibration c;
  c.k = number_of(*j, "k", where);
  c.eps = number_of(*j, "eps_deg", where) * deg;
  if (!(c.k > 0))
    throw Error(ErrorKind::kInput, fmt::format("expected a scale above 0, found {}", c.k),
                path + ": key k");
  for (const auto& [key, out, unit] :
       {std::tuple<const char*, double*, double>{"k_std", &c.k_std, 1.0},
        {"eps_std_deg", &c.eps_std, deg}}) {
    if (!j->contains(key) || j->at(key).is_null()) continue;
    *out = number_of(*j, key, where) * unit;
    if (!(*out >= 0))
      throw Error(ErrorKind::kInput, fmt::format("expected a sigma of at least 0, found {}", *out),
                  path + ": key " + key);
  }
  // Further states stand beside k and eps, or with the method that found them.
  const std::string method = text_of(file, "method");
  const auto state = [&](const char* key) {
    if (j->contains(key)) return number_of(*j, key, where);
    if (method.empty() || !file.contains("methods") || !file.at("methods").is_object()) return 0.0;
    const Json& all = file.at("methods");
    if (!all.contains(method) || !all.at(method).is_object() || !all.at(method).contains(key))
      return 0.0;
    return number_of(all.at(method), key, where);
  };
  c.drift = state("heading_drift_deg_h") * deg_per_h;
  c.pitch = state("pitch_mounting_deg") * deg;
  c.heading_model = text_of(*j, "heading_model");
  if (c.heading_model.empty()) c.heading_model = text_of(file, "heading_model");
  if (!c.heading_model.empty() && c.heading_model != "independent" &&
      c.heading_model != "mechanised")
    throw Error(ErrorKind::kInput,
                "expected independent or mechanised, found '" + c.heading_model + "'",
                path + ": key heading_model");
  return c;
}

ReckonResult reckon_drive(const Drive& drive, const ReckonOptions& options,
                          const std::function<void(const SolutionRow&)>& sink,
                          Diagnostics& diagnostics) {
  if (const std::string lacks = track_lacks(drive); !lacks.empty())
    throw Error(ErrorKind::kInput,
                "dead reckoning needs distance and heading: the drive has no " + lacks +
                    " (with [imu] see --mode inertial or filter)",
                drive.toml_path);
  const StartPoint from = start_of(drive);
  auto steps = read_track(drive, diagnostics);
  const std::string& file = drive.track.present      ? drive.track.file
                            : drive.odometer.present ? drive.odometer.file
                                                     : drive.velocity.file;
  for (TrackStep& s : steps) {
    s.heading -= options.calibration.drift * s.t;
    s.pitch -= options.calibration.pitch;
  }
  Diagnostics told_before;
  BodyAttitude body(read_body_attitude(drive, told_before));
  if (steps.size() < 2)
    throw Error(ErrorKind::kInput,
                fmt::format("expected a log of at least two rows, found {}", steps.size()), file);

  HeadingModel model = drive.heading_model;
  const std::string& said = options.calibration.heading_model;
  if (!said.empty()) {
    const bool mechanised = said == "mechanised";
    if (!drive.heading_model_given) {
      model = mechanised ? HeadingModel::kMechanised : HeadingModel::kIndependent;
    } else if (mechanised != (model == HeadingModel::kMechanised)) {
      diagnostics.warn("heading_model", drive.toml_path,
                       "the certificate was made with heading_model " + said +
                           ", the drive declares the other; the drive's is used");
    }
  }
  if (model == HeadingModel::kMechanised && options.integrator != Integrator::kExact &&
      drive.heading_reference == HeadingReference::kTrue)
    throw Error(ErrorKind::kUsage,
                "a drive of heading_model mechanised knows only the integrator exact",
                "--integrator");

  // Rows that ended before the start belong to no part of the way.
  std::size_t first = 0;
  const double t_start = drive.start.t;
  double part = 1;  // of the first step, where the start lies inside it
  const double usual = usual_step(steps);
  if (std::isfinite(t_start)) {
    while (first < steps.size() && steps[first].t <= t_start) ++first;
  } else if (drive.start.from_benchmark && drive.benchmarks.front().point.row > 0) {
    const auto row = static_cast<std::uint32_t>(drive.benchmarks.front().point.row);
    while (first < steps.size() && steps[first].row <= row) ++first;
  }
  if (first == steps.size())
    throw Error(ErrorKind::kInput,
                "the start lies at or after the last row of the log: nothing to reckon", file);
  if (first > 0)
    diagnostics.note("before_start", file,
                     fmt::format("{} rows end before the start; left out", first));
  double begin = steps[first].t - usual;
  if (first > 0) {
    begin = steps[first - 1].t;
    if (std::isfinite(t_start) && t_start > begin && steps[first].t > begin) {
      part = (steps[first].t - t_start) / (steps[first].t - begin);
      begin = t_start;
    }
  } else if (std::isfinite(t_start) && steps[first].t - t_start <= kGapSteps * usual) {
    begin = t_start;
  } else if (steps[first].ds == 0) {
    begin = steps[first].t;
  }

  Reckoner reckoner(drive, options, model, from.lat, from.lon);
  const bool recorded_h = drive.track.present && drive.track.columns.contains("height");
  ReckonResult result;
  result.begin = begin;
  double h = from.h, t = begin;
  if (recorded_h && !std::isfinite(drive.start.h) && !drive.start.has_state) h = steps[first].h;

  const auto emit = [&](double when, const Reckoner& at, double height, const TrackStep& s,
                        double ds, double dt) {
    SolutionRow row;
    row.t = when;
    row.lat = at.lat(), row.lon = at.lon(), row.h = height;
    double sh, ch, sp, cp;
    sincos(at.heading(), sh, ch);
    sincos(s.pitch, sp, cp);
    const double v = dt > 0 ? ds / options.calibration.k / dt : 0.0;
    row.ve = v * cp * sh + 0.0, row.vn = v * cp * ch + 0.0, row.vu = v * sp + 0.0;  // no -0
    if (body.known()) {
      // From the step's course to the body at this row: the angle that was taken out, and what the
      // body turned since mid-step (s.heading holds neither the drift nor the declared mounting).
      const AttitudeSample b = body.at(when);
      const double indicated = b.heading - drive.odometer_mounting_heading -
                               options.calibration.drift * when - s.heading;
      row.heading = wrap_2pi(at.heading() + options.calibration.eps +
                             drive.odometer_mounting_heading + indicated);
      row.pitch = b.pitch, row.roll = b.roll;
    } else {
      row.heading = wrap_2pi(at.heading());
      row.pitch = s.pitch, row.roll = 0;
    }
    row.qw = row.qx = row.qy = row.qz = kNone;
    row.x = row.y = row.z = kNone;
    row.frame = at.grid() ? FrameId::kGrid : FrameId::kGeographic;
    if (usual > 0 && dt > kGapSteps * usual) row.health |= kHealthGap;
    complete_row(row, drive.ellipsoid);
    sink(row);
    ++result.rows;
    result.last = row;
  };
  const auto crossed = [&](const TrackStep& s) {
    return Error(ErrorKind::kInput,
                 fmt::format("the log crosses the pole in row {} (t = {} s) with true headings, "
                             "which mean nothing there; expected a log of grid headings, [track] "
                             "heading_reference = \"grid\"",
                             s.row, s.t),
                 file);
  };

  const double rate = options.output_rate;
  bool near_pole = false;
  for (std::size_t i = first; i < steps.size(); ++i) {
    const TrackStep& s = steps[i];
    const double ds = i == first ? part * s.ds : s.ds;
    const double dt = std::max(s.t - t, 0.0);
    double sp, cp;
    sincos(s.pitch, sp, cp);
    const double level = ds * cp;  // (V-5) with pitch
    const double h_end = recorded_h ? s.h : h + ds * sp / options.calibration.k;
    const double h_mid = 0.5 * (h + h_end);
    const double earth_dt = drive.earth_rate ? dt : 0.0;
    if (i == first) {
      Reckoner at = reckoner;
      at.step(0.0, s.heading, h_mid, 0.0);  // for its heading only
      emit(begin, at, h, s, ds, dt);
    }
    if (rate > 0 && dt > 0) {
      // A part of a step is a step: exact where the step is. Stamps within 1e-9 of a period are the
      // step's own end.
      for (double m = std::floor(t * rate + 1e-9) + 1; m < s.t * rate - 1e-9; ++m) {
        const double u = (m / rate - t) / dt;
        Reckoner at = reckoner;
        at.step(u * level, s.heading, h_mid, u * earth_dt);
        if (!std::isfinite(at.lat()) || !std::isfinite(at.lon())) throw crossed(s);
        emit(m / rate, at, h + u * (h_end - h), s, ds, dt);
      }
    }
    reckoner.step(level, s.heading, h_mid, earth_dt);
    if (!std::isfinite(reckoner.lat()) || !std::isfinite(reckoner.lon())) throw crossed(s);
    if (!near_pole && !reckoner.grid() && std::fabs(reckoner.lat()) > kNearPole) {
      near_pole = true;
      diagnostics.warn("near_pole", file,
                       fmt::format("row {} lies above 89.9 deg: true headings lose their meaning, "
                                   "grid headings (heading_reference = \"grid\") keep it",
                                   s.row));
    }
    const bool on_period = std::fabs(s.t * rate - std::round(s.t * rate)) <= 1e-9;
    if (i + 1 == steps.size() || rate <= 0 || (dt > 0 && on_period))
      emit(s.t, reckoner, h_end, s, ds, dt);
    result.distance += std::fabs(ds) / options.calibration.k;
    h = h_end, t = s.t;
    ++result.steps;
  }
  result.end = t;
  return result;
}

}  // namespace loxo
