// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/navigate_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <variant>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/ins/handover.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/filter_settings.hpp"
#include "loxo/study/filter_start.hpp"
#include "loxo/study/output_raster.hpp"

namespace loxo {
namespace {

constexpr double kTimeSlack =
    1e-9;                         // s: a stamp and a multiple of the period that mean the same time
constexpr double kLongGap = 1.0;  // s: bridged too, but nothing after it is to be trusted
constexpr double kBridgeStep =
    0.02;  // s: of the steps across a gap, so that the Earth model is followed
constexpr double kHeightTau = 20.0;  // s: of the loop toward heights that declare no sigma
// s: how often the latitude is looked at for a change of frame, and the state for having left its
// domain. The hysteresis of 2 deg is hours wide for a car, minutes for an aircraft.
constexpr double kLookEvery = 0.1;
constexpr double kSingularNote = 1e-3;  // m: an estimated error worth telling
constexpr double kSingularBad = 1.0;    // m: beyond it later rows are not to be trusted

using AnyState =
    std::variant<State<GeographicMechanization, double>, State<TransverseMechanization, double>,
                 State<GridMechanization, double>, State<WanderMechanization, double>,
                 State<EcefMechanization, double>>;
template <class T>
struct MechanizationOf;
template <class M>
struct MechanizationOf<State<M, double>> {
  using type = M;
};
template <class X>
using mechanization_of = typename MechanizationOf<std::remove_cvref_t<X>>::type;

EcefState<double> to_ecef_state(const EarthModel& earth, const AnyState& any) {
  return std::visit([&](const auto& x) { return mechanization_of<decltype(x)>::to_ecef(earth, x); },
                    any);
}
AnyState in_frame(const EarthModel& earth, FrameId frame, const EcefState<double>& e) {
  switch (frame) {
    case FrameId::kGeographic:
      return GeographicMechanization::from_ecef(earth, e);
    case FrameId::kTransverse:
      return TransverseMechanization::from_ecef(earth, e);
    case FrameId::kGrid:
      return GridMechanization::from_ecef(earth, e);
    case FrameId::kWander:
      return WanderMechanization::from_ecef(earth, e);
    case FrameId::kEcef:
      break;
  }
  return EcefMechanization::from_ecef(earth, e);
}
AnyState stepped(const EarthModel& earth, const AnyState& any, const StepIncrement<double>& u) {
  return std::visit([&](const auto& x) -> AnyState { return step(earth, x, u); }, any);
}
bool finite(const EcefState<double>& e) {
  return std::isfinite(e.r.x + e.r.y + e.r.z) && std::isfinite(e.v.x + e.v.y + e.v.z) &&
         std::isfinite(e.q_eb.w + e.q_eb.x + e.q_eb.y + e.q_eb.z);
}

// A height and its rate at any time from samples in time order: between two linear, or cubic where
// both have a rate; outside the nearest.
struct HeightNow {
  double h = 0, rate = 0;  // m, m/s
};
class HeightAt {
 public:
  explicit HeightAt(std::vector<HeightSample> h) : h_(std::move(h)) {}
  HeightNow operator()(double t) {
    while (i_ + 1 < h_.size() && h_[i_ + 1].t <= t) ++i_;
    const HeightSample& a = h_[i_];
    if (t < a.t || i_ + 1 == h_.size()) return {a.h, 0};
    const HeightSample& b = h_[i_ + 1];
    const double T = b.t - a.t, u = (t - a.t) / T, step = b.h - a.h;
    if (!given(a.rate) || !given(b.rate)) return {a.h + step * u, step / T};
    // Hermite's cubic.
    const double ra = a.rate * T - step, rb = b.rate * T - step, w = 1 - u;
    return {a.h + step * u + u * w * (w * ra - u * rb),
            (step + (1 - 4 * u + 3 * u * u) * ra + (3 * u * u - 2 * u) * rb) / T};
  }
  const std::vector<HeightSample>& samples() const { return h_; }

 private:
  std::vector<HeightSample> h_;
  std::size_t i_ = 0;
};

std::vector<HeightSample> heights_of(const Drive& drive, Diagnostics& d) {
  std::vector<HeightSample> h = read_heights(drive, d);
  std::erase_if(h, [](const HeightSample& s) { return !std::isfinite(s.t + s.h); });
  std::stable_sort(h.begin(), h.end(),
                   [](const HeightSample& a, const HeightSample& b) { return a.t < b.t; });
  if (h.empty()) throw Error(ErrorKind::kInput, "no height could be read", drive.height.file);
  return h;
}

}  // namespace

// Numbers in another unit than declared cannot be navigated by; axes that do not fit gravity can,
// if an attitude is given that explains them.
void refuse_unsound(const ImuReader& reader, const Drive& drive, bool force) {
  const StartSection& s = drive.start;
  const bool attitude_given =
      s.has_state || (given(s.heading) && (given(s.roll) || given(s.pitch)));
  const std::string fault = !reader.unit_fault().empty() ? reader.unit_fault()
                            : attitude_given             ? std::string()
                                                         : reader.axes_fault();
  if (!fault.empty() && !force)
    throw Error(ErrorKind::kInput, fault + " (--force navigates all the same)");
}

void require_start(const Drive& drive) {
  const StartSection& s = drive.start;
  if (s.has_state || s.alignment_kind || given(s.heading)) return;
  throw Error(ErrorKind::kInput,
              "inertial navigation starts from a known state: give [start] with state = { … }, or "
              "with lat_deg, lon_deg and attitude = { heading, pitch, roll }, or with lat_deg, "
              "lon_deg and alignment = { kind = \"static\", duration = \"300 s\" } (or swaying, "
              "gyrocompass, fine, stored, in-motion)",
              "start");
}

namespace {

struct Begin {
  EcefState<double> state;
  double t = 0;
  AlignmentReport report;
  Vec<Body> bg, ba;  // found by a fine alignment: taken off the samples
};

Begin begin_of(const Drive& drive, const InertialOptions& o, double interval, double first_t,
               Diagnostics& d) {
  require_start(drive);
  FilterOptions f;
  f.force = o.force;
  f.vertical = "free";  // the loop reads the heights itself
  std::map<std::string, std::string> settings;
  const NavigatorConfig config = settings_of(drive, f, interval, kNone, false, 0, settings);
  const FilterStart start =
      filter_start(drive, f, config, read_measurements(drive, f, d), first_t, d);
  const NominalState& s = start.start.state;
  return {{s.r, s.v, s.q}, s.t, start.report, s.bg, s.ba};
}

}  // namespace

InertialResult inertial_drive(const Drive& drive, const InertialOptions& o, const RowSink& sink,
                              Diagnostics& d) {
  if (!drive.imu.present)
    throw Error(ErrorKind::kInput,
                "inertial navigation needs [imu]; a drive with [track] or [attitude] is for --mode "
                "reckon",
                drive.path);
  InertialResult out;
  const std::string vertical = !o.vertical.empty()    ? o.vertical
                               : drive.height.present ? "external"
                                                      : "free";
  if (vertical == "external" && !drive.height.present)
    throw Error(ErrorKind::kInput,
                "an external height needs [height] (file, columns time and height) in the drive; "
                "without it: --vertical free, fixed or ship",
                "height");
  out.vertical = vertical == "external" ? VerticalMode::kExternal
                 : vertical == "fixed"  ? VerticalMode::kFixed
                 : vertical == "ship"   ? VerticalMode::kShip
                                        : VerticalMode::kFree;
  const bool measured = out.vertical == VerticalMode::kExternal ||
                        (out.vertical == VerticalMode::kFixed && drive.height.present);
  HeightAt height_at(measured ? heights_of(drive, d) : std::vector<HeightSample>{});

  ImuReader reader(drive, d);
  ImuIncrement<double> sample;
  if (!reader.next(sample))
    throw Error(ErrorKind::kInput, "no IMU sample could be read", drive.imu.file);
  refuse_unsound(reader, drive, o.force);
  const double interval = reader.interval();
  const Begin begin = begin_of(drive, o, interval, sample.t - sample.dt, d);
  out.alignment = begin.report;
  out.begin_t = begin.t;

  const EarthModel earth = make_earth_model(drive.ellipsoid, o.meridian);
  const SwitchRule rule;
  FrameId frame = o.frame;
  if (o.auto_frame)
    frame = frame_wanted(rule, FrameId::kGeographic, normal_point(earth, begin.state.r).n.z);
  AnyState state = in_frame(earth, frame, begin.state);
  const double h0 = normal_point(earth, begin.state.r).h;
  if (out.vertical == VerticalMode::kExternal) {
    out.height_tau = kHeightTau;
    const auto& h = height_at.samples();
    if (given(drive.height_std) && h.size() > 1)
      out.height_tau = vertical_time(
          drive.height_std, (h.back().t - h.front().t) / static_cast<double>(h.size() - 1),
          given(drive.imu_errors.accel_noise) ? drive.imu_errors.accel_noise
                                              : 0.05 * mps_per_sqrt_h);
  }
  const VerticalGains gains = make_vertical_gains(out.height_tau > 0 ? out.height_tau : kHeightTau);
  double integral = 0;
  double t = begin.t;
  double next_look = t;
  std::uint32_t pending = 0, lasting = 0;  // bits of the next row; bits of all rows from here

  auto emit = [&](double at, const EcefState<double>& e) {
    if (!finite(e)) {
      out.broken = true;
      return;
    }
    SolutionRow r = solution_row(drive.ellipsoid, at, e.r, e.v, e.q_eb);
    r.frame = frame;
    r.health = pending | lasting;
    pending = 0;
    ++out.rows;
    sink(r);
  };
  // One step of the loop with everything that belongs to it.
  auto advance = [&](const StepIncrement<double>& u) {
    state = stepped(earth, state, u);
    t += u.dt;
    std::visit(
        [&](auto& x) {
          if (out.vertical == VerticalMode::kExternal) {
            x = damped(x, height_at(t).h, gains, u.dt, integral);
          } else if (measured) {
            const HeightNow now = height_at(t);
            x = constrained(x, now.h, now.rate);
          } else if (out.vertical != VerticalMode::kFree) {
            x = constrained(x, h0, 0.0);
          }
          // About 600 (v T/d)^2 m of error where the geographic frame passes a pole at distance d
          // (polar.md 3.4).
          const double error = 600.0 * mechanization_of<decltype(x)>::nearness(x, u.dt);
          if (error > kSingularNote || !(error == error)) {
            pending |= kHealthSingular;
            if (!(error <= kSingularBad)) lasting |= kHealthUncovered;
            if (!(error <= out.singular_error)) {
              out.singular_error = error;
              out.singular_t = t;
            }
          }
        },
        state);
    if (t < next_look) return;
    next_look = t + kLookEvery;
    const EcefState<double> e = to_ecef_state(earth, state);
    if (!finite(e)) {
      out.broken = true;
      return;
    }
    if (!o.auto_frame) return;
    const FrameId wanted = frame_wanted(rule, frame, normal_point(earth, e.r).n.z);
    if (wanted == frame) return;
    state = in_frame(earth, wanted, e);
    frame = wanted;
    pending |= kHealthSwitched;
    ++out.switches;
  };

  OutputRaster raster(o.output_period, t);
  emit(t, begin.state);
  double last_row = t;

  std::vector<ImuIncrement<double>> held;  // the first of a pair, where it has come
  ImuIncrement<double> before;             // the sample before the pair
  bool has_before = false;
  auto one = [&](const ImuIncrement<double>& a) {
    return has_before ? one_sample(before, a) : one_sample(a);
  };
  // Rows inside (end of the pair so far, a.t]: a copy of the state goes there, the loop itself does
  // not stop.
  auto rows_within = [&](const ImuIncrement<double>& a) {
    while (raster.on() && !out.broken) {
      const double at = raster.at();
      if (at > a.t - kTimeSlack) return;
      AnyState copy = state;
      if (!held.empty()) copy = stepped(earth, copy, one(held.front()));
      const double part = std::clamp((at - (a.t - a.dt)) / a.dt, 0.0, 1.0);
      if (part > 0) copy = stepped(earth, copy, one_sample(part_of(a, part)));
      emit(at, to_ecef_state(earth, copy));
      last_row = at;
      raster.advance();
    }
  };
  // A row that falls on the loop's own time, or on the end of the first of a pair.
  auto row_at_end = [&](double at) {
    const double due = raster.on() ? raster.at() : at;
    if (out.broken || std::fabs(due - at) > kTimeSlack) return;
    AnyState copy = state;
    if (!held.empty()) copy = stepped(earth, copy, one(held.front()));
    emit(due, to_ecef_state(earth, copy));
    last_row = due;
    raster.advance();
  };
  auto flush = [&] {  // an odd sample on its own
    if (held.empty()) return;
    const ImuIncrement<double> a = held.front();
    held.clear();
    advance(one(a));
    t = a.t;
    before = a;
    has_before = true;
  };
  auto take = [&](const ImuIncrement<double>& a) {
    rows_within(a);
    if (held.empty()) {
      held.push_back(a);
    } else {
      const ImuIncrement<double> first = held.front();
      held.clear();
      advance(two_samples(first, a));
      t = a.t;  // stamps do not add up their rounding
      before = a;
      has_before = true;
    }
    row_at_end(a.t);
  };

  bool more = true;
  double sample_end = t;  // up to where samples have been taken
  for (; more && !out.broken; more = reader.next(sample)) {
    if (!(sample.t > sample_end + kTimeSlack) || !(sample.dt > 0)) continue;
    const double from = sample.t - sample.dt;
    if (from < sample_end - kTimeSlack) {  // the start lies inside this sample
      sample = part_of(sample, (sample.t - sample_end) / sample.dt);
    } else if (from > sample_end + std::max(kTimeSlack, 0.01 * interval)) {
      // A hole: bridged with the mean of its neighbours.
      const double hole = from - sample_end;
      ++out.gaps;
      out.longest_gap = std::max(out.longest_gap, hole);
      const ImuIncrement<double> last =
          held.empty() ? (has_before ? before : sample) : held.front();
      flush();
      const Vec<Body> w =
          (last.dtheta * (1 / last.dt) + sample.dtheta * (1 / sample.dt) - begin.bg) * 0.5;
      const Vec<Body> f = (last.dv * (1 / last.dt) + sample.dv * (1 / sample.dt) - begin.ba) * 0.5;
      const long n = std::max(1L, static_cast<long>(std::ceil(hole / kBridgeStep)));
      if (hole > kLongGap) lasting |= kHealthUncovered;
      for (long i = 1; i <= n && !out.broken; ++i) {
        const double end =
            i == n ? from : sample_end + hole * static_cast<double>(i) / static_cast<double>(n);
        pending |= kHealthGap;
        take(from_mean_rates(end, hole / static_cast<double>(n), w, f));
        flush();
      }
      pending |= kHealthGap;
      has_before = false;
    } else if (sample.dt > 1.5 * interval) {  // bridged by the reader
      ++out.gaps;
      out.longest_gap = std::max(out.longest_gap, sample.dt);
      pending |= kHealthGap;
    }
    if (reader.saturated()) pending |= kHealthSaturated;
    ++out.imu_samples;
    sample_end = sample.t;
    ImuIncrement<double> corrected = sample;
    corrected.dtheta = sample.dtheta - begin.bg * sample.dt;
    corrected.dv = sample.dv - begin.ba * sample.dt;
    take(corrected);
  }
  flush();
  out.end_t = t;
  out.end = to_ecef_state(earth, state);
  if (!out.broken && t > last_row + kTimeSlack) emit(t, out.end);

  if (out.imu_samples == 0) {
    if (!(out.alignment.duration > 0))
      throw Error(ErrorKind::kInput,
                  fmt::format("no IMU sample after the start at t = {:.3f} s", begin.t),
                  drive.imu.file);
    d.warn("alignment_only", "start.alignment",
           fmt::format(
               "the alignment took all samples up to t = {:.2f} s: the solution is its one row",
               begin.t));
  }
  if (out.longest_gap > kLongGap)
    d.bad(
        "long_gap", "imu",
        fmt::format("a gap of {:.2f} s was bridged with the mean of its neighbours: the rows after "
                    "it are not to be trusted",
                    out.longest_gap));
  if (out.singular_error > 0 || given(out.singular_t))
    d.bad("singular", "--frame",
          fmt::format(
              "the geographic frame passed close to a pole at t = {:.2f} s; its azimuth turns "
              "too fast there, error of about {:.3g} m; use --frame auto, transverse, grid, "
              "wander or ecef",
              out.singular_t, out.singular_error));
  const auto& heights = height_at.samples();
  if (!heights.empty() && (heights.front().t > begin.t + 1 || heights.back().t < t - 1))
    d.warn(
        "short_height", "height",
        fmt::format("heights reach from {:.1f} s to {:.1f} s, the solution from {:.1f} s to {:.1f} "
                    "s: the nearest is held outside",
                    heights.front().t, heights.back().t, begin.t, t));
  return out;
}

}  // namespace loxo
