// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/calibrate_drive.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "loxo/earth/geodetic.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/online_calibration.hpp"
#include "loxo/text/csv.hpp"

namespace loxo {

TrackErrorModel track_error_model(const Drive& drive) {
  TrackErrorModel m;
  m.heading_bias = or_else(drive.attitude_errors.heading_bias, 0.0);
  m.heading_drift = or_else(drive.attitude_errors.heading_drift, 0.0);
  m.heading_noise = or_else(drive.attitude_errors.heading_noise, 0.0);
  m.side_slip = or_else(drive.odometer_errors.side_slip, 0.0);
  m.scale_noise = or_else(drive.odometer_errors.scale_noise, 0.0);
  m.quantisation = or_else(drive.odometer_errors.quantisation, 0.0);
  return m;
}

namespace {

// Steps of the track that end before the benchmark. A benchmark by time inside a step splits the
// step there.
std::size_t row_of(std::vector<TrackStep>& steps, double t_begin, const NamedBenchmark& named,
                   const std::string& where) {
  const Benchmark& b = named.point;
  if (b.row >= 0) {
    std::size_t n = 0;
    while (n < steps.size() && static_cast<std::ptrdiff_t>(steps[n].row) <= b.row) ++n;
    const auto last = static_cast<std::ptrdiff_t>(steps.back().row);
    if (b.row > last)
      throw Error(ErrorKind::kInput,
                  fmt::format("benchmark '{}' stands after row {}, the track has {} rows",
                              named.name, b.row, last),
                  where);
    return n;
  }
  if (std::isnan(b.t))
    throw Error(ErrorKind::kInput, fmt::format("benchmark '{}' needs t_s or after_row", named.name),
                where);
  const double slack = 1e-6 * std::max(1.0, std::fabs(b.t));
  if (b.t < t_begin - slack || b.t > steps.back().t + slack)
    throw Error(ErrorKind::kInput,
                fmt::format("benchmark '{}' is passed at {} s, the track runs from {} s to {} s",
                            named.name, b.t, t_begin, steps.back().t),
                where);
  std::size_t n = 0;
  double before = t_begin;
  while (n < steps.size() && steps[n].t <= b.t + slack) before = steps[n++].t;
  if (n == steps.size() || b.t - before <= slack) return n;
  TrackStep first = steps[n];
  const double part = (b.t - before) / (steps[n].t - before);
  first.t = b.t;
  first.ds *= part;
  first.row = n > 0 ? steps[n - 1].row : 0;
  steps[n].ds *= 1.0 - part;
  steps.insert(steps.begin() + static_cast<std::ptrdiff_t>(n), first);
  return n + 1;
}

// By the joint filter. A fault that only it minds is its own where other methods stand beside it.
Calibration online_method(const Drive& drive, const CalibrateOptions& options,
                          Diagnostics& diagnostics) {
  Calibration c;
  c.method = "online";
  if (!drive.imu.present || !drive.odometer.present) {
    c.why = "needs [imu] and [odometer]";
    return c;
  }
  if (!options.online && options.only.empty()) {
    c.why = "not asked for: --method online runs the joint filter";
    return c;
  }
  Diagnostics told;
  OnlineCalibration r;
  try {
    r = online_calibration(drive, told);
  } catch (const Error& e) {
    if (options.only == "online") throw;
    c.why = e.what();
    return c;
  }
  diagnostics.append(told);
  c.valid = r.valid;
  c.why = r.why;
  c.k = r.k;
  c.eps = r.eps;
  c.ln_k_std = r.k_std / r.k;
  c.eps_std = r.eps_std;
  c.correlation = r.correlation;
  return c;
}

}  // namespace

const Calibration* DriveCalibration::find(const std::string& name) const {
  for (const auto& m : methods)
    if (m.method == name) return &m;
  return nullptr;
}

DriveCalibration calibrate_drive(const Drive& drive, const CalibrateOptions& options,
                                 Diagnostics& diagnostics) {
  DriveCalibration out;
  const std::string where = drive.path;
  // The filter needs neither a track nor benchmarks; the others say what they miss.
  const std::string lacks = track_lacks(drive);
  const bool any = options.only.empty() && options.online, only = options.only == "online";
  if ((any || only) && drive.imu.present && drive.odometer.present &&
      (drive.benchmarks.size() < 2 || !lacks.empty())) {
    out.methods = {online_method(drive, options, diagnostics)};
    for (const char* name : {"replay", "least_squares", "rhumb", "geodesic", "gauss",
                             "mean_latitude", "start_latitude"}) {
      if (only) break;
      Calibration c;
      c.method = name;
      c.why = lacks.empty() ? fmt::format("needs two [[benchmark]] or more, found {}",
                                          drive.benchmarks.size())
                            : "the drive has no " + lacks + " to make a track of";
      out.methods.push_back(c);
    }
    out.chord = out.route = out.signed_area = kNone;
    if (!out.methods[0].valid) return out;
    out.recommended = "online";
    out.why = only ? "the only one asked for" : "the only kind that is valid here";
    if (drive.odometer_kind == "pulses" || drive.odometer_kind == "counter")
      out.metres_per_pulse = drive.odometer_scale / out.methods[0].k;
    return out;
  }
  auto steps = read_track(drive, diagnostics);
  if (steps.size() < 2)
    throw Error(ErrorKind::kInput,
                fmt::format("expected a track of at least two rows, found {}", steps.size()),
                where);
  if (drive.benchmarks.size() < 2)
    throw Error(ErrorKind::kInput,
                fmt::format("calibration needs two [[benchmark]] or more, the first where the "
                            "drive starts; found {}",
                            drive.benchmarks.size()),
                where);
  // The first step's beginning: one usual interval before its end, unless the first benchmark says
  // otherwise.
  double t_begin = steps[0].t - (steps[1].t - steps[0].t);
  const auto& first = drive.benchmarks.front().point;
  if (first.row < 0 && !std::isnan(first.t) && first.t < steps[0].t)
    t_begin = std::min(t_begin, first.t);
  const std::size_t start_row = row_of(steps, t_begin, drive.benchmarks.front(), where);
  if (start_row > 0) {
    t_begin = steps[start_row - 1].t;
    steps.erase(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(start_row));
  }
  std::vector<Benchmark> benchmarks;
  std::vector<std::size_t> rows;
  for (std::size_t j = 1; j < drive.benchmarks.size(); ++j) {
    if (steps.empty())
      throw Error(ErrorKind::kInput, "the first benchmark stands at the end of the log", where);
    rows.push_back(row_of(steps, t_begin, drive.benchmarks[j], where));
    benchmarks.push_back(drive.benchmarks[j].point);
    benchmarks.back().row = static_cast<std::ptrdiff_t>(rows.back());  // of the steps handed on
    if (j > 1 && rows[j - 1] < rows[j - 2])
      throw Error(
          ErrorKind::kInput,
          fmt::format(
              "benchmark '{}' is passed before '{}'; they stand in the order they are passed",
              drive.benchmarks[j].name, drive.benchmarks[j - 1].name),
          where);
  }
  steps.resize(std::max<std::size_t>(rows.back(), 1));

  RecordedTrack track;
  track.ellipsoid = &drive.ellipsoid;
  track.steps = steps;
  track.t0 = t_begin;
  track.model = drive.heading_model;
  track.reference = drive.heading_reference;
  track.earth_rate = drive.earth_rate;
  track.taken_scale = drive.track.present ? drive.track_scale : 1.0;
  track.taken_offset = drive.track.present ? drive.track_heading_offset : 0.0;
  TrackErrorModel errors = track_error_model(drive);
  // Noise of a reading and of the way, as one relative to the readings' mean square: exact where
  // they are alike.
  double way = 0, squared = 0;
  for (const TrackStep& s : track.steps) way += std::fabs(s.ds), squared += s.ds * s.ds;
  if (squared > 0) {
    const double each = or_else(drive.odometer_errors.noise, 0.0),
                 root = or_else(drive.odometer_errors.distance_noise, 0.0);
    errors.scale_noise = std::sqrt(
        errors.scale_noise * errors.scale_noise +
        (static_cast<double>(track.steps.size()) * each * each + way * root * root) / squared);
  }
  Benchmark start = first;
  start.row = 0;
  const Benchmark& end = benchmarks.back();
  const auto wanted = [&](const std::string& name) {
    return options.only.empty() || options.only == name;
  };

  Calibration replayed = calibrate_replay(track, start, end, errors);
  replayed.method = "replay";

  const Replay to_end(track, start, {rows.back()});
  const ChordStart recorded = chord_start(to_end, to_end.run({}).front(), end);
  StateVector x{};
  if (replayed.valid) {
    x[index(State::kScale)] = std::log(replayed.k);
    x[index(State::kAngle)] = replayed.eps;
  }
  const Moments moments = to_end.moments(x).front();
  out.chord = std::hypot(moments.north, moments.east);
  out.route = moments.route;
  out.signed_area = moments.area;

  const bool grid = drive.heading_reference == HeadingReference::kGrid;
  if (wanted("replay")) out.methods.push_back(replayed);
  for (ChordMethod method : {ChordMethod::kStartLatitude, ChordMethod::kMeanLatitude,
                             ChordMethod::kRhumb, ChordMethod::kGeodesic, ChordMethod::kGauss}) {
    const std::string name(chord_method_name(method));
    if (!wanted(name)) continue;
    Calibration c;
    c.method = name;
    if (grid) {
      c.why = "grid headings: chord methods by true azimuth do not apply";
    } else {
      TwoPointOptions two;
      two.benchmark_std = std::sqrt(0.5 * (start.std * start.std + end.std * end.std));
      two.continuous_lon = true;
      const auto r = calibrate_two_point(
          drive.ellipsoid, method,
          {start.lat, start.lon, end.lat, end.lon, recorded.end_lat, recorded.end_lon}, two);
      c.valid = r.valid;
      c.why = r.why;
      if (r.valid) {
        c.k = r.value.k;
        c.eps = r.value.eps;
        // The sensors' share is that of the same track by replay.
        c.ln_k_std = replayed.valid ? replayed.ln_k_std : r.ln_k_std;
        c.eps_std = replayed.valid ? replayed.eps_std : r.eps_std;
        c.correlation = replayed.valid ? replayed.correlation : 0.0;
        c.iterations = 0;
        const double k = replayed.valid ? replayed.k : c.k,
                     eps = replayed.valid ? replayed.eps : c.eps;
        const double azimuth = std::atan2(moments.east, moments.north);
        if (method == ChordMethod::kStartLatitude || method == ChordMethod::kMeanLatitude) {
          const auto bias =
              method == ChordMethod::kStartLatitude
                  ? start_latitude_bias(drive.ellipsoid, start.lat, out.chord, azimuth, k, eps)
                  : mean_latitude_bias(drive.ellipsoid, start.lat, out.chord, azimuth, k, eps);
          c.formula_ln_k = bias.ln_k;
          c.formula_eps = bias.eps;
        }
        if (drive.heading_model == HeadingModel::kIndependent) {
          const auto bias = route_bias(drive.ellipsoid, start.lat, moments.area, moments.north,
                                       moments.east, k, eps);
          c.route_ln_k = bias.ln_k;
          c.route_eps = bias.eps;
        }
        StateVector own{};
        own[index(State::kScale)] = std::log(c.k);
        own[index(State::kAngle)] = c.eps;
        const auto miss = to_end.residual(to_end.run(own).front(), end);
        c.closure = std::hypot(miss[0], miss[1]);
      }
    }
    out.methods.push_back(c);
  }
  if (wanted("least_squares")) {
    auto c = calibrate_least_squares(track, start, benchmarks, rows, errors, options.estimate);
    for (std::size_t j = 0; j < c.residuals.size(); ++j)
      c.residuals[j].name = drive.benchmarks[j + 1].name;
    out.methods.push_back(c);
  }
  if (wanted("online")) out.methods.push_back(online_method(drive, options, diagnostics));

  const auto valid = [&](const char* name) {
    const auto* m = out.find(name);
    return m != nullptr && m->valid;
  };
  if (benchmarks.size() > 1 && valid("least_squares")) {
    out.recommended = "least_squares";
    out.why = "several benchmarks: all of them, weighted by what is declared";
  } else if (valid("replay")) {
    out.recommended = "replay";
    out.why = "exact for any route and heading model";
  } else if (valid("least_squares")) {
    out.recommended = "least_squares";
    out.why = "the replay of the two ends is not valid";
  } else {
    for (const char* name :
         {"rhumb", "geodesic", "gauss", "mean_latitude", "start_latitude", "online"})
      if (out.recommended.empty() && valid(name)) {
        out.recommended = name;
        out.why = "the only kind that is valid here";
      }
  }
  if (const auto* best = out.find(out.recommended);
      best != nullptr && drive.odometer.present &&
      (drive.odometer_kind == "pulses" || drive.odometer_kind == "counter"))
    out.metres_per_pulse = drive.odometer_scale / best->k;
  return out;
}

namespace {
Json number(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }

Json method_json(const Calibration& m) {
  Json j;
  j["k"] = number(m.k);
  j["k_std"] = number(m.ln_k_std * m.k);
  j["eps_deg"] = number(m.eps / deg);
  j["eps_std_deg"] = number(m.eps_std / deg);
  j["correlation"] = number(m.correlation);
  j["closure_m"] = number(m.closure);
  j["iterations"] = m.iterations;
  j["valid"] = m.valid;
  j["why"] = m.why;
  if (!std::isnan(m.smallest_singular)) j["smallest_singular_m"] = number(m.smallest_singular);
  if (!std::isnan(m.formula_ln_k)) {
    j["formula_bias_k"] = number(m.formula_ln_k * m.k);
    j["formula_bias_eps_deg"] = number(m.formula_eps / deg);
  }
  if (!std::isnan(m.route_ln_k)) {
    j["route_bias_k"] = number(m.route_ln_k * m.k);
    j["route_bias_eps_deg"] = number(m.route_eps / deg);
  }
  if (m.method != "least_squares") return j;
  j["chi2"] = number(m.chi2);
  j["dof"] = m.dof;
  const std::size_t n = m.states.size();
  for (std::size_t i = 2; i < n && i < m.values.size(); ++i) {
    const double std = std::sqrt(m.covariance[i * n + i]), value = m.values[i];
    switch (m.states[i]) {
      case State::kDrift:
        j["heading_drift_deg_h"] = value / deg_per_h;
        j["heading_drift_std_deg_h"] = std / deg_per_h;
        break;
      case State::kPitch:
        j["pitch_mounting_deg"] = value / deg;
        j["pitch_mounting_std_deg"] = std / deg;
        break;
      default:
        j[std::string(state_name(m.states[i])) + "_m"] = value;
        j[std::string(state_name(m.states[i])) + "_std_m"] = std;
    }
  }
  j["unobservable"] = m.unobservable;
  j["residuals"] = Json::array();
  const bool heights = std::find(m.states.begin(), m.states.end(), State::kPitch) != m.states.end();
  for (const auto& r : m.residuals) {
    Json one{{"name", r.name}, {"north_m", number(r.north)}, {"east_m", number(r.east)}};
    if (heights) one["up_m"] = number(r.up);
    j["residuals"].push_back(one);
  }
  return j;
}
const char* model_name(const Drive& drive) {
  return drive.heading_model == HeadingModel::kMechanised ? "mechanised" : "independent";
}
}  // namespace

Json to_json(const Drive& drive, const DriveCalibration& result) {
  Json j;
  j["command"] = "calibrate";
  j["recommended"] = result.recommended;
  j["recommended_why"] = result.why;
  j["heading_model"] = model_name(drive);
  j["methods"] = Json::object();
  for (const auto& m : result.methods) j["methods"][m.method] = method_json(m);
  j["chord_m"] = number(result.chord);
  j["route_m"] = number(result.route);
  j["signed_area_m2"] = number(result.signed_area);
  j["metres_per_pulse"] = number(result.metres_per_pulse);
  return j;
}

Json certificate(const Drive& drive, const DriveCalibration& result, const std::string& version) {
  Json j = to_json(drive, result);
  j["command"] = "certificate";
  j["format"] = 1;
  j["name"] = drive.name;
  j["vehicle"] = drive.name;
  j["program_version"] = version;
  j["input_hash"] = file_hash(drive.folder.empty() ? drive.path : drive.toml_path);
  if (const auto* best = result.find(result.recommended)) {
    const double k_std = best->ln_k_std * best->k;
    j["method"] = best->method;
    j["k"] = best->k;
    j["k_std"] = number(k_std);
    j["eps_deg"] = best->eps / deg;
    j["eps_std_deg"] = number(best->eps_std / deg);
    j["correlation"] = number(best->correlation);
    // Of k and eps_deg.
    const double eps_std = best->eps_std / deg, both = best->correlation * k_std * eps_std;
    j["covariance"] = {{number(k_std * k_std), number(both)},
                       {number(both), number(eps_std * eps_std)}};
    j["valid"] = best->valid;
  }
  return j;
}

Drift drift_against(const Calibration& now, const Json& then, const std::string& path) {
  for (const char* key : {"k", "eps_deg", "k_std", "eps_std_deg"})
    if (!then.is_object() || !then.contains(key) || !then[key].is_number())
      throw Error(ErrorKind::kInput,
                  "expected a certificate with the number '" + std::string(key) + "'", path);
  Drift d;
  d.dk = now.k - then["k"].get<double>();
  d.deps = wrap_pi(now.eps - then["eps_deg"].get<double>() * deg);
  const auto of = [](double ks, double es, double rho) {
    Eigen::Matrix2d c;
    c << ks * ks, rho * ks * es, rho * ks * es, es * es;
    return c;
  };
  const double rho = then.contains("correlation") && then["correlation"].is_number()
                         ? then["correlation"].get<double>()
                         : 0.0;
  const Eigen::Matrix2d c =
      of(now.ln_k_std * now.k, now.eps_std, or_else(now.correlation, 0.0)) +
      of(then["k_std"].get<double>(), then["eps_std_deg"].get<double>() * deg, rho);
  const Eigen::Vector2d diff(d.dk, d.deps);
  d.chi2 =
      c.determinant() > 0 ? diff.dot(c.inverse() * diff) : (diff.norm() > 1e-12 ? INFINITY : 0.0);
  d.probability = std::exp(-0.5 * d.chi2);  // chi-square with two degrees of freedom
  d.drifted = d.probability < 0.01;
  return d;
}

}  // namespace loxo
