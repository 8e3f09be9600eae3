// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/planar_drive.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "loxo/estimate/planar_filter.hpp"
#include "loxo/estimate/spool.hpp"
#include "loxo/log/solution_file.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/drive_measurements.hpp"

namespace loxo {
namespace {

// A start without a heading looks for one over this way, or ten sigma of the
// fixes.
constexpr double kShortestChord = 20.0;  // m

// The recorded heading at any ascending time: it is known at the middle of each
// step.
class HeadingAt {
 public:
  explicit HeadingAt(const std::vector<TrackStep>& steps) : steps_(&steps) {}
  double operator()(double t) {
    const auto& s = *steps_;
    const auto mid = [&](std::size_t i) { return i == 0 ? s[0].t : 0.5 * (s[i].t + s[i - 1].t); };
    while (i_ + 2 < s.size() && mid(i_ + 1) < t) ++i_;
    if (s.size() < 2) return s[0].heading;
    const double a = mid(i_), b = mid(i_ + 1);
    const double u = b > a ? std::clamp((t - a) / (b - a), 0.0, 1.0) : 0.0;
    return s[i_].heading + u * wrap_pi(s[i_ + 1].heading - s[i_].heading);
  }

 private:
  const std::vector<TrackStep>* steps_;
  std::size_t i_ = 0;
};

// What the smoother needs of one epoch: the filtered state, and how the next
// prediction came of it.
struct Node {
  PlanarState filtered, predicted;
  PlanarMatrix to_next = PlanarMatrix::Identity();
  double heading = 0, h = 0, v = 0, vu = 0, pitch = 0;
  bool is_row = false;
};

PlanarConfig config_of(const Drive& drive, std::map<std::string, std::string>& meta) {
  PlanarConfig c;
  c.ellipsoid = drive.ellipsoid;
  const OdometerErrors& o = drive.odometer_errors;
  c.scale_noise = or_else(o.scale_noise, 0.01);
  c.side_slip = or_else(o.side_slip, 0.5 * deg);
  c.quantisation = std::hypot(or_else(o.quantisation, 0.0), or_else(o.noise, 0.0));
  c.heading_noise = or_else(drive.attitude_errors.heading_noise, 0.5 * deg_per_sqrt_h);
  const auto tell = [&](const char* key, double value, double said) {
    meta[key] = fmt::format("{:.4g}{}", value, given(said) ? "" : " (assumed)");
  };
  tell("scale_noise", c.scale_noise, o.scale_noise);
  tell("side_slip_deg", c.side_slip / deg, o.side_slip);
  tell("heading_noise_deg_sqrt_h", c.heading_noise / deg_per_sqrt_h,
       drive.attitude_errors.heading_noise);
  return c;
}

bool heading_is_absolute(const Drive& drive) {
  if (drive.track.present) return !drive.track_heading_is_step;
  return drive.attitude.present || drive.heading.columns.contains("heading") ||
         drive.heading.columns.contains("lat");
}

// The angle from the track as recorded to the fixes, over the first way that is
// long enough.
struct FirstCourse {
  bool found = false;
  double eps = 0, std = 0, t = 0;
};
FirstCourse first_course(const std::vector<TrackStep>& steps, const std::vector<Fix>& fixes,
                         const Ellipsoid& ell, double k) {
  FirstCourse out;
  if (fixes.empty()) return out;
  const Fix& from = fixes.front();
  double north = 0, east = 0, last = steps.front().t;
  std::size_t j = 0;
  for (const TrackStep& s : steps) {
    if (s.t <= from.t) {
      last = s.t;
      continue;
    }
    const double d = s.ds * std::cos(s.pitch) / k;
    north += d * std::cos(s.heading), east += d * std::sin(s.heading);
    while (j + 1 < fixes.size() && fixes[j].t < s.t) ++j;
    const Fix& to = fixes[j];
    const double way = std::hypot(north, east);
    if (std::fabs(to.t - s.t) > std::max(2 * (s.t - last), 0.2)) {
      last = s.t;
      continue;
    }
    last = s.t;
    const double sigma = std::hypot(or_else(to.std_e, 0), or_else(from.std_e, 0));
    if (way < std::max(kShortestChord, 10 * sigma)) continue;
    const double sl = std::sin(from.lat);
    const double n = (to.lat - from.lat) * meridian_radius(ell, sl);
    const double e =
        wrap_pi(to.lon - from.lon) * prime_vertical_radius(ell, sl) * std::cos(from.lat);
    if (std::fabs(std::hypot(n, e) / way - 1) > 0.3) continue;  // an outlier, or a slip
    out.found = true;
    out.eps = wrap_pi(std::atan2(east, north) - std::atan2(e, n));
    out.std = std::hypot(std::max(sigma, 0.5) / way, 3 * deg);
    out.t = from.t;
    return out;
  }
  return out;
}

void push_constants(FilterResult& out, const PlanarState& s) {
  const auto sd = [&](int i) { return std::sqrt(std::max(0.0, s.P(i, i))); };
  out.k = std::exp(s.ln_k);
  out.k_std = out.k * sd(kPlanarK);
  out.eps_h = wrap_pi(s.eps);
  out.eps_h_std = sd(kPlanarEps);
  out.k_eps_correlation =
      sd(kPlanarK) > 0 ? s.P(kPlanarK, kPlanarEps) / (sd(kPlanarK) * sd(kPlanarEps)) : 0;
  out.constants = {{"k", out.k, out.k_std}, {"eps_deg", out.eps_h / deg, out.eps_h_std / deg}};
  if (s.P(kPlanarDrift, kPlanarDrift) > 0)
    out.constants.push_back(
        {"heading_drift_deg_h", s.drift / deg_per_h, sd(kPlanarDrift) / deg_per_h});
  if (s.P(kPlanarRight, kPlanarRight) > 0) {
    out.constants.push_back({"lever_right_m", s.right, sd(kPlanarRight)});
    out.constants.push_back({"lever_forward_m", s.forward, sd(kPlanarForward)});
  }
}

}  // namespace

FilterResult planar_drive(const Drive& drive, const FilterOptions& o, const RowSink& sink,
                          Diagnostics& d) {
  if (drive.heading_reference == HeadingReference::kGrid)
    throw Error(ErrorKind::kInput,
                "the filter of a drive without [imu] takes true headings only; "
                "grid headings are "
                "for --mode reckon",
                drive.toml_path);
  FilterResult out;
  out.has_odometer = true;
  const auto steps = read_track(drive, d);
  if (steps.size() < 2)
    throw Error(ErrorKind::kInput,
                fmt::format("expected a log of at least two rows, found {}", steps.size()),
                drive.toml_path);
  DriveMeasurements m = read_measurements(drive, o, d);
  std::vector<Fix> fixes = m.fixes;
  fixes.insert(fixes.end(), m.benchmarks.begin(), m.benchmarks.end());
  std::stable_sort(fixes.begin(), fixes.end(),
                   [](const Fix& a, const Fix& b) { return a.t < b.t; });

  PlanarConfig config = config_of(drive, out.meta);
  config.gate = !m.sparse_fixes && o.fix_every < 60.0 && m.fixes.size() > 20;
  PlanarState s;
  s.ln_k = o.calibrated ? std::log(o.k) : 0.0;
  s.eps = o.calibrated ? o.eps : 0.0;
  const StartSection& st = drive.start;
  const double step0 = steps[1].t - steps[0].t;
  double t0 = or_else(st.t, steps.front().t - step0), lat = st.lat, lon = st.lon, pos_std = 0.1;
  if (drive.start.from_benchmark) pos_std = std::max(drive.benchmarks.front().point.std, 0.05);
  if (!given(lat)) {
    const Fix* first = nullptr;
    for (const Fix& f : m.all_fixes)
      if (f.t >= t0) {
        first = &f;
        break;
      }
    if (first == nullptr)
      throw Error(ErrorKind::kInput,
                  "no start position: neither [start] with lat_deg and lon_deg, nor a "
                  "[[benchmark]], nor a fix",
                  drive.toml_path);
    lat = first->lat, lon = first->lon, t0 = first->t;
    pos_std = std::max(first->std_e, first->std_n);
  }
  const double eps_std = o.calibrated && given(o.eps_std) ? std::max(o.eps_std, 1e-6) : 2 * deg;
  double heading_std = std::hypot(eps_std, or_else(drive.attitude_errors.heading_bias, 0.0));
  out.alignment.method = "track";
  if (heading_is_absolute(drive) || given(st.heading)) {
    heading_std =
        std::hypot(heading_std, given(st.heading) ? or_else(st.heading_std, 0.1 * deg) : 0.0);
  } else {
    std::vector<Fix> later;
    for (const Fix& f : fixes)
      if (f.t >= t0) later.push_back(f);
    const FirstCourse c = first_course(steps, later, drive.ellipsoid, std::exp(s.ln_k));
    if (!c.found)
      throw Error(ErrorKind::kWork,
                  fmt::format("nothing tells the heading at the start: the "
                              "track holds turns only. "
                              "Give [start] attitude = {{ heading = … }}, or "
                              "fixes over more than "
                              "{:.0f} m",
                              kShortestChord),
                  "start.attitude");
    s.eps = c.eps, heading_std = c.std;
    out.alignment.method = "first_course";
  }
  const AttitudeErrors& ae = drive.attitude_errors;
  const double drift_std =
      or_else(ae.heading_drift, heading_is_absolute(drive) ? 0.0 : 10 * deg_per_h);
  const double lever_std = drive.fix.present ? 0.5 : 0.0;  // where the antenna stands is not said
  s.right = drive.fix_lever[0], s.forward = drive.fix_lever[1];
  const bool lever_given = s.right != 0 || s.forward != 0;
  const double ln_k_std = o.calibrated && given(o.k_std)
                              ? std::max(o.k_std / o.k, 1e-6)
                              : or_else(drive.odometer_errors.scale, 0.03);
  s.P.diagonal() << pos_std * pos_std, pos_std * pos_std, heading_std * heading_std,
      ln_k_std * ln_k_std, drift_std * drift_std, 0, 0;
  if (!lever_given)
    s.P(kPlanarRight, kPlanarRight) = s.P(kPlanarForward, kPlanarForward) = lever_std * lever_std;
  s.at = reckon_start(lat, lon);
  s.t = t0;

  std::size_t i = 0;
  while (i < steps.size() && steps[i].t <= t0) ++i;
  if (i == steps.size())
    throw Error(ErrorKind::kInput, "the start lies at or after the last row of the log",
                drive.toml_path);
  PlanarFilter filter(config, s);
  HeadingAt heading_at(steps);
  const double first_heading = steps[i].heading;
  out.alignment.heading = wrap_2pi(first_heading - s.eps);
  out.alignment.heading_std = heading_std;
  out.meta["heading_std_deg"] = fmt::format("{:.3g}", heading_std / deg);

  SpoolFile spool = o.smooth ? open_spool() : SpoolFile();
  long nodes = 0;
  const bool body = drive.attitude.present || drive.heading.columns.contains("heading");
  const auto row_of = [&](const PlanarState& x, double heading, double h, double v, double vu,
                          double pitch) {
    SolutionRow r;
    r.t = x.t;
    r.lat = x.at.lat, r.lon = wrap_pi(x.at.lon), r.h = h;
    double sc, cc;
    sincos(heading - x.eps, sc, cc);
    const double speed = v * std::exp(-x.ln_k);
    r.ve = speed * sc + 0.0, r.vn = speed * cc + 0.0, r.vu = vu;
    r.heading = wrap_2pi(body ? heading + drive.odometer_mounting_heading : heading - x.eps);
    r.pitch = pitch;
    r.qw = r.qx = r.qy = r.qz = kNone;
    r.x = r.y = r.z = kNone;
    r.std_n = std::sqrt(std::max(0.0, x.P(kPlanarN, kPlanarN)));
    r.std_e = std::sqrt(std::max(0.0, x.P(kPlanarE, kPlanarE)));
    r.std_heading = std::sqrt(std::max(0.0, x.P(kPlanarEps, kPlanarEps)));
    complete_row(r, drive.ellipsoid);
    return r;
  };

  std::size_t f = 0;
  while (f < fixes.size() && fixes[f].t < t0 - 1e-9) ++f;
  PlanarMatrix product = PlanarMatrix::Identity();
  double h = std::isfinite(st.h) ? st.h : 0.0, t = t0, next_history = t0;
  const bool recorded_h = drive.track.present && drive.track.columns.contains("height");
  const double period = o.output_period;
  double next_row = period > 0 ? (std::floor(t0 / period + 1e-6) + 1) * period : t0;
  Node node{};
  bool node_open = false;
  const auto write_node = [&] {
    if (std::fwrite(&node, sizeof node, 1, spool.get()) != 1) spool_failed("the smoother's steps");
    ++nodes;
  };
  // An epoch: fixes that fall on it, then a row.
  const auto epoch = [&](bool is_row, double v, double vu, double pitch) {
    const double heading = heading_at(t);
    if (node_open) {
      node.predicted = filter.state();
      node.to_next = product;
      write_node();
    }
    for (; f < fixes.size() && fixes[f].t <= t + 1e-9; ++f)
      filter.fix(fixes[f].lat, fixes[f].lon, fixes[f].std_e, fixes[f].std_n, heading, h);
    if (o.smooth) {
      node.filtered = filter.state();
      node.heading = heading, node.h = h, node.v = v, node.vu = vu, node.pitch = pitch;
      node.is_row = is_row;
      node_open = true;
      product = PlanarMatrix::Identity();
    } else if (is_row) {
      ++out.rows;
      sink(row_of(filter.state(), heading, h, v, vu, pitch));
    }
    if (t >= next_history) {
      const PlanarState& x = filter.state();
      ConstantsRow c;
      c.t = t, c.k = std::exp(x.ln_k), c.k_std = c.k * std::sqrt(x.P(kPlanarK, kPlanarK));
      c.eps_h = wrap_pi(x.eps), c.eps_h_std = std::sqrt(x.P(kPlanarEps, kPlanarEps));
      out.history.push_back(c);
      next_history += 10;
    }
  };
  epoch(true, 0, 0, 0);
  for (; i < steps.size() && t < o.until; ++i) {
    const TrackStep& s1 = steps[i];
    const double dt = s1.t - t, begin = t, begin_h = h;
    const double ds = i > 0 && steps[i - 1].t < begin - 1e-9
                          ? s1.ds * dt / (s1.t - steps[i - 1].t)  // the start lies inside it
                          : s1.ds;
    const double end_h =
        recorded_h ? s1.h : h + ds * std::sin(s1.pitch) * std::exp(-filter.state().ln_k);
    const double level = ds * std::cos(s1.pitch);
    const double v = dt > 0 ? level / dt : 0, vu = dt > 0 ? (end_h - h) / dt : 0;
    while (t < s1.t - 1e-9) {
      double to = s1.t;
      const bool fix_inside = f < fixes.size() && fixes[f].t < to - 1e-9;
      if (fix_inside) to = std::max(fixes[f].t, t);
      const bool row_inside = period > 0 && next_row <= to + 1e-9;
      if (row_inside) to = std::max(next_row, t);
      const double share = dt > 0 ? (to - t) / dt : 0;
      const double h1 = begin_h + (end_h - begin_h) * (to - begin) / dt;
      if (to > t) {
        const PlanarMatrix F =
            filter.predict(level * share, s1.heading, 0.5 * (h + h1), to - t, share);
        product = F * product;
      }
      t = to, h = h1;
      if (!std::isfinite(filter.state().at.lat) || !std::isfinite(filter.state().at.lon))
        throw Error(ErrorKind::kInput,
                    fmt::format("the track crosses a pole at t = {} s with true headings", t),
                    drive.toml_path);
      const bool at_fix = f < fixes.size() && fixes[f].t <= t + 1e-9;
      if (row_inside) next_row += period;
      if (row_inside || at_fix || period <= 0) epoch(row_inside || period <= 0, v, vu, s1.pitch);
    }
  }
  epoch(true, 0, 0, 0);
  out.duration = t - t0;
  push_constants(out, filter.state());
  if (const InnovationCount& c = filter.innovations(); c.used + c.deweighted + c.rejected > 0)
    out.sensors.push_back({"fix", c});
  if (const InnovationCount& c = filter.innovations(); c.rejected > 0) {
    d.warn("outlier", "fix", fmt::format("{} fixes outside the gate", c.rejected));
    if (4 * c.rejected > c.used + c.deweighted)
      d.bad("contradicted", "fix",
            fmt::format("{} of {} fixes contradict the track: its declared "
                        "errors (scale_noise, "
                        "side_slip, heading_noise, heading_drift) are too "
                        "small, or a section is "
                        "wrong; the stated sigmas are not to be trusted",
                        c.rejected, c.rejected + c.used + c.deweighted));
  }
  if (!o.smooth) return out;

  // Rauch-Tung-Striebel, newest first (the last node is still open), then out
  // in order of time.
  SpoolFile rows = open_spool();
  long n = 0;
  const auto put = [&](const PlanarState& x, const Node& at) {
    if (!at.is_row) return;
    const SolutionRow r = row_of(x, at.heading, at.h, at.v, at.vu, at.pitch);
    if (std::fwrite(&r, sizeof r, 1, rows.get()) != 1) spool_failed("the smoothed rows");
    ++n;
  };
  PlanarState smooth = node.filtered;
  put(smooth, node);
  for (long j = nodes - 1; j >= 0; --j) {
    std::fseek(spool.get(), j * static_cast<long>(sizeof(Node)), SEEK_SET);
    if (std::fread(&node, sizeof node, 1, spool.get()) != 1)
      throw Error(ErrorKind::kWork, "the temporary file of the smoother cannot be read back");
    // States that are known exactly have no spread: the pseudo-inverse leaves
    // them alone.
    const Eigen::FullPivLU<PlanarMatrix> lu(node.predicted.P + 1e-18 * PlanarMatrix::Identity());
    const PlanarMatrix C = (lu.solve(node.to_next * node.filtered.P)).transpose();
    const PlanarVector x = C * difference(drive.ellipsoid, smooth, node.predicted, node.h);
    const PlanarMatrix P = node.filtered.P + C * (smooth.P - node.predicted.P) * C.transpose();
    smooth = node.filtered;
    correct(drive.ellipsoid, smooth, node.h, x);
    smooth.P = 0.5 * (P + P.transpose());
    put(smooth, node);
  }
  push_constants(out, smooth);
  for (long j = n - 1; j >= 0; --j) {
    SolutionRow r;
    std::fseek(rows.get(), j * static_cast<long>(sizeof r), SEEK_SET);
    if (std::fread(&r, sizeof r, 1, rows.get()) != 1)
      throw Error(ErrorKind::kWork, "the temporary file of smoothed rows cannot be read back");
    ++out.rows;
    sink(r);
  }
  return out;
}

}  // namespace loxo
