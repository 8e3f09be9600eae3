// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/filter_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "loxo/estimate/smoother.hpp"
#include "loxo/estimate/spool.hpp"
#include "loxo/ins/handover.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/coarse_odometer.hpp"
#include "loxo/study/filter_findings.hpp"
#include "loxo/study/filter_settings.hpp"
#include "loxo/study/filter_start.hpp"
#include "loxo/study/output_raster.hpp"
#include "loxo/study/planar_drive.hpp"

namespace loxo {
namespace {

SolutionRow row_at(const Navigator& nav, double age, FrameId frame) {
  if (age == 0) return nav.row(frame);
  NominalState s = nav.state();
  s.r = s.r - s.v * age;
  s.t -= age;
  // Carried back along the velocity, whose error comes with it: in a gap of the inertial unit `age`
  // is up to the gap's length.
  Covariance<kStates> P = nav.stated_covariance();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < kStates; ++j) P.p[kDr + i][j] -= age * P.p[kDv + i][j];
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < kStates; ++i) P.p[i][kDr + j] -= age * P.p[i][kDv + j];
  return solution_row(nav.config().ellipsoid, s, P, frame, nav.health());
}

// The frame of a row, by the same rule as the strapdown loop's (polar.md 3.4).
class FrameChoice {
 public:
  explicit FrameChoice(const FilterOptions& o) : auto_(o.auto_frame), frame_(o.frame) {}
  void apply(SolutionRow& r) {
    if (auto_) {
      const FrameId before = frame_;
      frame_ = frame_wanted(SwitchRule{}, frame_, std::sin(r.lat));
      if (frame_ != before && started_) r.health |= kHealthSwitched;
    }
    started_ = true;
    r.frame = frame_;
  }

 private:
  bool auto_, started_ = false;
  FrameId frame_;
};

// Which source holds the solution, stretch by stretch: what most of a stretch was.
class Trust {
 public:
  explicit Trust(double begin) : at_(begin) { row_.begin = begin; }
  // After each IMU sample: its components make one fix.
  void sample(const Navigator& nav) {
    const InnovationCount& f = nav.innovations(Sensor::kFix);
    fixes_ += f.used + f.deweighted > components_;
    components_ = f.used + f.deweighted;
  }
  void stretch(const Navigator& nav) {
    const double length = nav.t() - at_;
    if (!(length > 0)) return;
    const Seen now = seen(nav);
    const NavigatorConfig& c = nav.config();
    const long wheel = now.wheel - seen_.wheel, out = now.out - seen_.out;
    std::string trusted, why;
    const double rest = now.standing - seen_.standing;
    if (rest >= 0.5 * length || (rest > 0 && wheel == 0))
      trusted = "standing", why = "IMU, wheel and filter agree";
    else if (now.fixes > seen_.fixes)
      trusted = "fixes", why = "position fixes accepted";
    else if (now.dead - seen_.dead >= 0.5 * length)
      trusted = "ins", why = "the wheel is silent while the IMU moves";
    else if (out > wheel)
      trusted = "ins", why = "wheel readings outside the gate";
    else if (c.use_odometer && wheel > 0)
      trusted = "odometer", why = "no fix; wheel and IMU agree";
    else if (c.use_odometer)
      trusted = "ins", why = "no fix; the wheel says nothing";
    else
      trusted = c.use_nhc ? "constraint" : "ins", why = "no wheel, no fix";
    if (trusted != row_.trusted || why != row_.why) {
      close(at_);
      row_ = {at_, 0, trusted, why};
    }
    row_.fixes += now.fixes - seen_.fixes;
    row_.wheel += wheel;
    row_.wheel_left_out += out;
    const SolutionRow r = nav.row(FrameId::kEcef);
    // Two normals: -2 ln 0.05 times the mean variance, exact for a circle.
    row_.radius = std::sqrt(-2 * std::log(0.05) * (r.std_e * r.std_e + r.std_n * r.std_n) / 2);
    seen_ = now;
    at_ = nav.t();
  }
  std::vector<SegmentRow> end(const Navigator& nav) {
    stretch(nav);
    close(at_);
    return std::move(rows_);
  }

 private:
  struct Seen {
    double standing = 0, dead = 0;
    long fixes = 0, wheel = 0, out = 0;
  };
  Seen seen(const Navigator& nav) const {
    const InnovationCount& w = nav.innovations(Sensor::kOdometer);
    return {nav.events().standing, nav.events().dead_encoder, fixes_, w.used + w.deweighted,
            w.rejected};
  }
  void close(double t) {
    if (row_.trusted.empty()) return;
    row_.end = t;
    rows_.push_back(row_);
  }
  double at_;
  long fixes_ = 0, components_ = 0;
  Seen seen_;
  SegmentRow row_;
  std::vector<SegmentRow> rows_;
};

ConstantsRow constants_row(const NominalState& s, const Covariance<kStates>& P) {
  auto sd = [&](int i) { return std::sqrt(std::max(0.0, P.p[i][i])); };
  return {s.t,   s.scale,  sd(kScale), s.eps_h,     sd(kEpsH), s.eps_p,    sd(kEpsP),
          s.tau, sd(kTau), s.offset,   sd(kOffset), s.bg.z,    sd(kBg + 2)};
}

// extra: variances of the states of extra_states.hpp, null where the filter has none.
void push_constants(FilterResult& out, const NominalState& s, const Covariance<kStates>& P,
                    const double* extra, const NavigatorConfig& c, bool odometer) {
  auto sd = [&](int i) { return std::sqrt(std::max(0.0, P.p[i][i])); };
  out.constants.clear();
  auto add = [&](const char* name, double v, int i, double unit) {
    if (P.p[i][i] > 0) out.constants.push_back({name, v / unit, sd(i) / unit});
  };
  if (odometer) add("k", s.scale, kScale, 1.0);
  if (odometer || c.use_nhc) {
    add("eps_deg", s.eps_h, kEpsH, deg);
    add("pitch_mounting_deg", s.eps_p, kEpsP, deg);
    add("lever_right_m", s.lever.x, kLever, 1.0);
    add("lever_forward_m", s.lever.y, kLever + 1, 1.0);
    add("lever_up_m", s.lever.z, kLever + 2, 1.0);
  }
  if (odometer) add("delay_s", s.tau, kTau, 1.0);
  if (odometer) add("speed_offset_mps", s.offset, kOffset, 1.0);
  const double b[3] = {s.bg.x, s.bg.y, s.bg.z}, a[3] = {s.ba.x, s.ba.y, s.ba.z};
  const char* axis[3] = {"right", "forward", "up"};
  for (int i = 0; i < 3; ++i)
    add(fmt::format("gyro_bias_{}_deg_h", axis[i]).c_str(), b[i], kBg + i, deg_per_h);
  for (int i = 0; i < 3; ++i)
    add(fmt::format("accel_bias_{}_ug", axis[i]).c_str(), a[i], kBa + i, ug);
  add("gyro_scale_up", s.sg.z, kSg + 2, 1.0);
  const auto more = [&](const std::string& name, double v, int i, double unit) {
    const double variance = extra ? extra[i - kStates] : 0.0;
    if (variance > 0) out.constants.push_back({name, v / unit, std::sqrt(variance) / unit});
  };
  const double l[3] = {s.antenna.x, s.antenna.y, s.antenna.z};
  for (int i = 0; i < 3; ++i) more(fmt::format("antenna_{}_m", axis[i]), l[i], kAntenna + i, 1.0);
  more("height_bias_m", s.height_bias, kHeightBias, 1.0);
  more("heading_bias_deg", s.heading_bias, kHeadingBias, deg);
  for (int i = 0; i < 6; ++i) {
    const int other = i % 2 == 0 ? (i < 2 ? 1 : 0) : (i < 4 ? 2 : 1);
    more(fmt::format("gyro_misalignment_{}_to_{}_mrad", axis[i / 2], axis[other]),
         s.misalignment[i], kMisalignment + i, 1e-3);
  }
  out.k = s.scale;
  out.k_std = sd(kScale);
  out.eps_h = s.eps_h;
  out.eps_h_std = sd(kEpsH);
  out.k_eps_correlation =
      out.k_std > 0 && out.eps_h_std > 0 ? P.p[kScale][kEpsH] / (out.k_std * out.eps_h_std) : 0.0;
}

}  // namespace

FilterResult filter_drive(const Drive& drive, const FilterOptions& o, const RowSink& sink,
                          Diagnostics& d) {
  if (!drive.imu.present) {
    if (const std::string lacks = track_lacks(drive); !lacks.empty())
      throw Error(ErrorKind::kInput,
                  "the filter needs [imu], or distances and headings: the drive has no " + lacks,
                  drive.path);
    return planar_drive(drive, o, sink, d);
  }
  if (o.vertical == "external" && !drive.height.present)
    throw Error(ErrorKind::kInput,
                "an external height needs [height] (file, columns time and height) in the drive; "
                "without it: --vertical free, fixed or ship",
                "height");
  DriveMeasurements m = read_measurements(drive, o, d);
  refuse_swapped_fixes(drive, m.all_fixes);
  FilterResult out;
  auto reader = std::make_unique<ImuReader>(drive, d);
  ImuIncrement<double> sample;
  if (!reader->next(sample))
    throw Error(ErrorKind::kInput, "no IMU sample could be read", drive.imu.file);
  refuse_unsound(*reader, drive, o.force);
  const double dt0 = reader->interval(), first_t = sample.t - sample.dt;
  const bool is_speed = !m.ticks.empty() && m.ticks.front().is_speed;
  NavigatorConfig config =
      settings_of(drive, o, dt0, m.tick_interval, is_speed, m.mean_speed, out.meta);
  if (m.ticks.empty()) config.use_odometer = false;
  config.unsigned_wheel = m.unsigned_wheel;
  config.fix_gate = !m.sparse_fixes && o.fix_every < 60.0;
  out.has_odometer = config.use_odometer;
  {
    // Receivers' own sigmas are optimistic in streets: at least 3 m, unless they claim a
    // carrier-phase solution.
    std::vector<double> sds;
    for (const Fix& f : m.fixes) sds.push_back(f.std_e);
    const double typical = median(sds);
    config.fix_std_min = given(drive.fix_std)              ? drive.fix_std
                         : given(typical) && typical > 0.3 ? 3.0
                                                           : 0.0;
  }
  take_scatter(m.scatter, m.mean_way * m.tick_interval, config, out.meta, d);
  coarse_check(drive, m, o, first_t, config, out.meta, d);
  FilterStart begin = filter_start(drive, o, config, m, first_t, d);
  if (begin.rest.samples > 0) {
    config.standstill.sigma_w = std::max(begin.rest.sigma_w, 1e-6);
    config.standstill.sigma_f = std::max(begin.rest.sigma_f, 1e-5);
    config.zaru_sway[0] = begin.rest.sway[0];
    config.zaru_sway[1] = begin.rest.sway[1];
  } else {
    config.zaru_sway[0] = config.zaru_sway[1] = 0.02 * deg;  // an idling engine's
  }
  out.alignment = begin.report;
  std::unique_ptr<SmootherTape> tape;
  Navigator nav(config);
  if (o.smooth) {
    tape = std::make_unique<SmootherTape>(has_extra_states(config));
    nav.set_tape(tape.get());
  }
  nav.set_sink(o.innovations);
  nav.start(begin.start);
  const double t_start = begin.start.state.t;
  FrameChoice frame(o);
  auto emit = [&](SolutionRow r) {
    if (!std::isfinite(norm(Vec<Ecef>{r.x, r.y, r.z}) + r.std_e + r.std_n + r.std_u)) {
      out.diverged = true;  // no row is better than one without numbers
      if (!given(out.diverged_t)) out.diverged_t = r.t;
      return;
    }
    frame.apply(r);
    ++out.rows;
    sink(r);
  };
  if (!o.smooth) emit(nav.row(o.frame));

  std::size_t i_tick = 0, i_fix = 0, i_mark = 0, i_head = 0, i_height = 0, i_vel = 0;
  // Ticks and fixes of the time before the start are not the filter's.
  while (i_fix < m.fixes.size() && m.fixes[i_fix].t <= t_start) ++i_fix;
  while (i_mark < m.benchmarks.size() && m.benchmarks[i_mark].t <= t_start) ++i_mark;
  while (i_tick < m.ticks.size() && m.ticks[i_tick].t <= t_start) ++i_tick;
  while (i_head < m.headings.size() && m.headings[i_head].t <= t_start) ++i_head;
  while (i_height < m.heights.size() && m.heights[i_height].t <= t_start) ++i_height;
  while (i_vel < m.velocities.size() && m.velocities[i_vel].t <= t_start) ++i_vel;
  const double ahead = 3.0;
  OutputRaster raster(o.output_period, t_start);
  double next_history = t_start, next_progress = t_start;
  std::uint32_t carried = 0;
  std::array<std::pair<long, double>, static_cast<std::size_t>(Sensor::kCount)> nis_before{};
  Trust trust(t_start);
  double travelled = 0;
  bool more = true;
  for (; more && sample.t <= o.until; more = reader->next(sample)) {
    if (!(sample.t > nav.t() + 1e-9)) continue;
    if (sample.t - sample.dt < nav.t() - 1e-9 && sample.t - nav.t() < sample.dt) {
      // The start lies inside this sample.
      const double part = (sample.t - nav.t()) / sample.dt;
      if (part < 1e-3) continue;
      sample.dtheta = sample.dtheta * part;
      sample.dv = sample.dv * part;
      sample.dt = sample.t - nav.t();
    }
    for (; i_tick < m.ticks.size() && m.ticks[i_tick].t <= sample.t + ahead; ++i_tick)
      nav.odometer(m.ticks[i_tick]);
    for (; i_fix < m.fixes.size() && m.fixes[i_fix].t <= sample.t; ++i_fix) nav.fix(m.fixes[i_fix]);
    for (; i_mark < m.benchmarks.size() && m.benchmarks[i_mark].t <= sample.t; ++i_mark)
      nav.benchmark(m.benchmarks[i_mark]);
    for (; i_head < m.headings.size() && m.headings[i_head].t <= sample.t; ++i_head)
      nav.heading(m.headings[i_head]);
    for (; i_height < m.heights.size() && m.heights[i_height].t <= sample.t; ++i_height)
      nav.height(m.heights[i_height]);
    for (; i_vel < m.velocities.size() && m.velocities[i_vel].t <= sample.t; ++i_vel)
      nav.velocity(m.velocities[i_vel]);
    const double before = nav.t();
    nav.imu(sample);
    ++out.imu_samples;
    carried |= nav.health() | (reader->saturated() ? kHealthSaturated : 0u);
    travelled += norm(nav.state().v) * (nav.t() - before);
    if (nav.diverged() || (nav.health() & kHealthDiverged) || out.diverged) {
      out.diverged = true;
      out.diverged_t = nav.t();
      break;
    }
    trust.sample(nav);
    if (raster.on()) {
      for (; raster.at() <= nav.t() + 1e-9; raster.advance()) {
        if (!o.smooth) {
          SolutionRow r = row_at(nav, nav.t() - raster.at(), o.frame);
          r.t = raster.at();
          r.health |= carried;
          emit(r);
        }
        carried = 0;
      }
    } else if (!o.smooth) {
      SolutionRow r = nav.row(o.frame);
      r.health |= carried;
      carried = 0;
      emit(r);
    }
    if (nav.t() >= next_history) {
      out.history.push_back(constants_row(nav.state(), nav.covariance()));
      next_history += 10.0;
      InnovationRow n;
      n.t = nav.t();
      for (std::size_t i = 0; i < n.nis.size(); ++i) {
        const InnovationCount& c = nav.innovations(static_cast<Sensor>(i));
        const long count = c.used + c.deweighted + c.rejected - nis_before[i].first;
        n.nis[i] =
            count > 0 ? (c.nis_sum - nis_before[i].second) / static_cast<double>(count) : kNone;
        nis_before[i] = {nis_before[i].first + count, c.nis_sum};
      }
      if (out.history.size() > 1) out.innovations.push_back(n);
      trust.stretch(nav);
    }
    if (o.progress && nav.t() >= next_progress) {
      o.progress(nav.t());
      next_progress += 5.0;
    }
  }
  if (out.imu_samples == 0 && t_start > sample.t + 2 * reader->interval())
    throw Error(ErrorKind::kInput,
                fmt::format("no IMU sample after the start at t = {:.3f} s", t_start),
                drive.imu.file);
  out.segments = trust.end(nav);
  out.duration = nav.t() - t_start;
  out.diverged = out.diverged || (nav.health() & kHealthDiverged) != 0;
  if (out.diverged && !given(out.diverged_t)) out.diverged_t = nav.t();
  for (int i = 0; i < static_cast<int>(Sensor::kCount); ++i) {
    const auto s = static_cast<Sensor>(i);
    const InnovationCount& c = nav.innovations(s);
    if (c.used + c.deweighted + c.rejected > 0) out.sensors.push_back({sensor_name(s), c});
  }
  out.events = nav.events();
  double extra[kExtra];
  for (int i = 0; i < kExtra; ++i) extra[i] = nav.extra_covariance().e[i][i];
  push_constants(out, nav.state(), nav.covariance(), nav.has_extra() ? extra : nullptr, config,
                 config.use_odometer);

  tell_findings(drive, m, config, out, {t_start, nav.t(), first_t, travelled, out.diverged}, d);
  if (o.smooth) {
    // Newest first: spooled, then given out forward. History and constants become the smoothed
    // ones.
    const SpoolFile spool = open_spool();
    long n = 0;
    std::vector<ConstantsRow> history;
    double next_back = 1e300;
    bool first = true;
    tape->smooth([&](const NominalState& s, const Covariance<kStates>& P, std::uint32_t health) {
      const SolutionRow r = solution_row(drive.ellipsoid, s, P, o.frame, health);
      if (std::fwrite(&r, sizeof r, 1, spool.get()) != 1) spool_failed("the smoothed rows");
      ++n;
      if (first)
        push_constants(out, s, P, nav.has_extra() ? tape->extra_variances() : nullptr, config,
                       config.use_odometer);
      first = false;
      if (s.t <= next_back) {
        history.push_back(constants_row(s, P));
        next_back = s.t - 10.0;
      }
    });
    std::reverse(history.begin(), history.end());
    out.history = std::move(history);
    constexpr long kBlock = 4096;
    std::vector<SolutionRow> block(kBlock);
    for (long end = n; end > 0;) {
      const long from = std::max(0L, end - kBlock), count = end - from;
      std::fseek(spool.get(), from * static_cast<long>(sizeof(SolutionRow)), SEEK_SET);
      if (std::fread(block.data(), sizeof(SolutionRow), static_cast<std::size_t>(count),
                     spool.get()) != static_cast<std::size_t>(count))
        throw Error(ErrorKind::kWork, "the temporary file of smoothed rows cannot be read back");
      for (long i = count - 1; i >= 0; --i) emit(block[static_cast<std::size_t>(i)]);
      end = from;
    }
  }
  // Told whole, as scale, mounting and lever arm are: what is declared is taken out of the stamps
  // before the filter sees them.
  for (Estimated& e : out.constants)
    if (e.name == "delay_s") e.value += drive.odometer.delay;
  for (ConstantsRow& row : out.history) row.tau += drive.odometer.delay;
  return out;
}

}  // namespace loxo
