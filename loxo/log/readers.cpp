// SPDX-License-Identifier: Apache-2.0
// The samples of a drive: SI, body axes right-forward-up, stamps less the section's delay.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/log/channel.hpp"
#include "loxo/log/drive.hpp"
#include "loxo/log/solution_file.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

std::string number(double x) {
  char text[40];
  std::snprintf(text, sizeof text, "%.6g", x);
  return text;
}

}  // namespace

struct ImuReader::Impl {
  Impl(const Drive& drive, Diagnostics& diagnostics)
      : d(&diagnostics),
        channel(drive, "imu", diagnostics),
        rate(drive.imu_kind == "rate"),
        stamp(drive.imu_stamp),
        axes(axes_to_rfu(drive.imu_axes, drive.imu.where + ".axes")),
        gyro_range(drive.imu_gyro_range),
        accel_range(drive.imu_accel_range),
        gyro_bias{drive.imu_gyro_bias[0], drive.imu_gyro_bias[1], drive.imu_gyro_bias[2]},
        accel_bias{drive.imu_accel_bias[0], drive.imu_accel_bias[1], drive.imu_accel_bias[2]},
        start_t(drive.start.t) {
    gyro = channel.at("gyro");
    accel = channel.at("accel");
    where = drive.imu.where;
    // The head of the log: nominal interval, and a look at units and axes.
    while (head.size() < 1001 && read_row()) head.push_back(row);
    std::vector<double> steps;
    for (std::size_t i = 1; i < head.size(); ++i) steps.push_back(head[i].t - head[i - 1].t);
    if (!steps.empty()) {
      std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2),
                       steps.end());
      interval = steps[steps.size() / 2];
    }
    if (interval > 0) look();
  }

  struct Row {
    double t = 0;
    Vec<Body> w, f;
    bool saturated = false;
  };
  static constexpr double kFastTurn = 6.0;     // rad/s: 344 deg/s, no vehicle turns so for long
  static constexpr double kOften = 0.02;       // share of the rows
  static constexpr double kLargeTurn = 1.0;    // rad/s
  static constexpr double kLargeForce = 15.0;  // m/s^2
  static constexpr int kStill = 4;             // repetitions of one value
  static constexpr double kStandingForce = 0.05, kEarthRateTime = 5.0;  // m/s^2, s
  static constexpr double kEarthRate = 7.292115e-5;                     // rad/s

  bool read_row() {
    while (channel.next(*d)) {
      const auto& v = channel.values();
      auto turned = [&](std::size_t at) {
        const double x = v[at], y = v[at + 1], z = v[at + 2];
        return Vec<Body>{axes[0] * x + axes[1] * y + axes[2] * z,
                         axes[3] * x + axes[4] * y + axes[5] * z,
                         axes[6] * x + axes[7] * y + axes[8] * z};
      };
      row.t = channel.t();
      row.w = turned(gyro);
      row.f = turned(accel);
      if (!std::isfinite(dot(row.w, row.w) + dot(row.f, row.f))) {
        d->bad("bad_row", channel.where(), "[imu] expected six numbers, found nan; row skipped");
        continue;
      }
      row.saturated = at_limit();
      ++rows;
      const double per_second = rate || !(interval > 0) ? 1.0 : 1.0 / interval;
      if (dot(row.w, row.w) * per_second * per_second > kFastTurn * kFastTurn) ++fast;
      return true;
    }
    if (!told_fast && rows > 0 && static_cast<double>(fast) > kOften * static_cast<double>(rows)) {
      told_fast = true;
      d->bad("imu_units", where + ".units.gyro",
             number(100.0 * static_cast<double>(fast) / static_cast<double>(rows)) +
                 " % of the rates are above " + number(kFastTurn) +
                 " rad/s: are they in deg/s, not rad/s?");
    }
    return false;
  }

  // At the declared range; where none is declared, a large value that stands still to the last
  // digit.
  bool at_limit() {
    const double f[6] = {row.w.x, row.w.y, row.w.z, row.f.x, row.f.y, row.f.z};
    const double per_second = rate || !(interval > 0) ? 1.0 : 1.0 / interval;
    bool at = false;
    for (std::size_t i = 0; i < 6; ++i) {
      const double x = std::fabs(f[i]) * per_second, limit = i < 3 ? gyro_range : accel_range;
      if (given(limit)) {
        at = at || x >= limit * (1 - 1e-9);
      } else {
        still[i] = x > (i < 3 ? kLargeTurn : kLargeForce) && f[i] == before[i] ? still[i] + 1 : 0;
        at = at || still[i] >= kStill;
      }
      before[i] = f[i];
    }
    if (at)
      d->warn("saturated", channel.where(),
              given(gyro_range) || given(accel_range)
                  ? "[imu] a value at the sensor's declared limit"
                  : "[imu] a large value stands still: the sensor's limit?");
    return at;
  }

  // Norm of specific force and of rate over the first rows: the likely unit or axis is named.
  void look() {
    const double scale = rate ? 1.0 : 1.0 / interval;
    double f = 0, f2 = 0, w = 0, up = 0;
    Vec<Body> turn{};
    for (const Row& r : head) {
      const double n = norm(r.f) * scale;
      f += n, f2 += n * n, w += norm(r.w), up += r.f.z;
      turn = turn + r.w;
    }
    const auto n = static_cast<double>(head.size());
    f /= n, w *= scale / n, up *= scale / n;
    const double spread = std::sqrt(std::fmax(0.0, f2 / n - f * f));
    if (f < 7 || f > 13) {
      std::string what =
          "specific force has a mean norm of " + number(f) + " m/s^2 where about 9.8 was expected";
      struct Guess {
        double ratio;
        const char* text;
      };
      constexpr double kG = 9.80665;
      for (const Guess& g :
           {Guess{1 / kG, ": is it in g, not m/s^2?"}, Guess{kG, ": is it in m/s^2, not g?"},
            Guess{1000 / kG, ": is it in mg?"}, Guess{1e6 / kG, ": is it in ug?"},
            Guess{1 / 0.3048, ": is it in ft/s^2?"}, Guess{100, ": is it in cm/s^2?"},
            Guess{interval, ": are these increments (kind = \"increment\"), not rates?"},
            Guess{1 / interval, ": are these rates (kind = \"rate\"), not increments?"},
            Guess{2, ": are the stamps twice as dense as the samples were?"},
            Guess{0.5, ": are the stamps half as dense as the samples were?"}})
        if (std::fabs(f / 9.8 / g.ratio - 1) < 0.05) {
          what += g.text;
          break;
        }
      fault = where + ".units.accel: " + what;
      d->bad("imu_units", where + ".units.accel", what);
    } else if (up < -0.7 * f) {
      const std::string what =
          "specific force points down on the up axis (" + number(up) +
          " m/s^2): a z axis that looks down (FRD?) or gravity with the other sign";
      axes_fault = where + ".axes: " + what;
      d->bad("imu_axes", where + ".axes", what);
    } else if (up < 0.5 * f) {
      const std::string what = "the up axis shows " + number(up) + " of " + number(f) +
                               " m/s^2: is the declared axis triple right?";
      axes_fault = where + ".axes: " + what;
      d->warn("imu_axes", where + ".axes", what);
    }
    if (w > 2.0) {
      if (fault.empty())
        fault = where + ".units.gyro: rates have a mean norm of " + number(w) +
                " rad/s: are they in deg/s, not rad/s?";
      d->bad("imu_units", where + ".units.gyro",
             "rates have a mean norm of " + number(w) + " rad/s: are they in deg/s, not rad/s?");
    } else if (spread < kStandingForce && n * interval > kEarthRateTime) {
      // Standing: what is left of the gyros' mean is the Earth's turn and the bias. A good gyro
      // that shows it 57 times too large or too small is in the other unit.
      const double seen = norm(turn) * (scale / n) / kEarthRate;
      const auto near = [&](double x) { return std::fabs(seen / x - 1) < 0.15; };
      const double per_deg = 180 / kPi;
      if (near(per_deg) || near(1 / per_deg))
        d->warn(
            "imu_units", where + ".units.gyro",
            "at rest the gyros show " + number(seen) + " times the Earth's rate: are they in " +
                (near(per_deg) ? "deg/s, not rad/s? (or biased by so much)" : "rad/s, not deg/s?"));
    }
  }

  bool next(ImuIncrement<double>& s) {
    Row now;
    if (at < head.size()) {
      now = head[at++];
    } else {
      if (!read_row()) return false;
      now = row;
    }
    double dt = have_last ? now.t - last.t : interval;
    if (!have_last && !rate) {
      // Increments are over (previous stamp, this stamp]; the first starts at the start state's
      // time.
      if (given(start_t) && start_t < now.t && now.t - start_t < 3 * interval) dt = now.t - start_t;
    }
    const bool gap = have_last && dt > 3.001 * interval;
    saturated = now.saturated;
    s.t = now.t;
    if (rate) {
      Vec<Body> w = now.w, f = now.f;
      if (stamp == "instant" && have_last && !gap) {
        w = 0.5 * (last.w + now.w);
        f = 0.5 * (last.f + now.f);
      } else if (have_last && !gap && dt > 1.5 * interval) {
        // A lost sample or two: the mean of the neighbours.
        w = 0.5 * (last.w + now.w);
        f = 0.5 * (last.f + now.f);
      }
      s.dt = gap ? interval : dt;
      if (stamp == "middle" && !gap) s.t = now.t + 0.5 * interval;
      s.dtheta = w * s.dt;
      s.dv = f * s.dt;
    } else {
      s.dt = gap ? interval : dt;
      s.dtheta = now.w;
      s.dv = now.f;
    }
    s.dtheta = s.dtheta - gyro_bias * s.dt;
    s.dv = s.dv - accel_bias * s.dt;
    last = now;
    have_last = true;
    return true;
  }

  Diagnostics* d;
  Channel channel;
  bool rate;
  std::string stamp, where;
  std::array<double, 9> axes;
  double gyro_range, accel_range;
  Vec<Body> gyro_bias, accel_bias;
  double start_t;
  std::size_t gyro = 0, accel = 0;
  double interval = 0;
  std::vector<Row> head;
  std::size_t at = 0;
  Row row, last;
  bool have_last = false, saturated = false, told_fast = false;
  std::size_t rows = 0, fast = 0;
  int still[6]{};
  double before[6]{};
  std::string fault, axes_fault;
};

ImuReader::ImuReader(const Drive& drive, Diagnostics& diagnostics)
    : impl_(std::make_unique<Impl>(drive, diagnostics)) {}
ImuReader::~ImuReader() = default;
bool ImuReader::next(ImuIncrement<double>& sample) { return impl_->next(sample); }
double ImuReader::interval() const { return impl_->interval; }
bool ImuReader::saturated() const { return impl_->saturated; }
const std::string& ImuReader::unit_fault() const { return impl_->fault; }
const std::string& ImuReader::axes_fault() const { return impl_->axes_fault; }

std::vector<OdometerTick> read_odometer(const Drive& drive, Diagnostics& d) {
  const bool speed = drive.odometer_kind == "speed", counter = drive.odometer_kind == "counter";
  const double k = drive.odometer_scale;
  const auto value = [](const Channel& c, Diagnostics& told) {
    const double v = c.has("value") ? c.values()[c.at("value")]
                                    : std::hypot(c.value(c.at("east")), c.value(c.at("north")));
    if (!given(v))
      told.bad("bad_row", c.where(), "[odometer] expected a number, found nan; row skipped");
    return v;
  };
  if (!counter)
    return rows_in_order<OdometerTick>(
        drive, "odometer", d,
        [&](const Channel& c, Diagnostics& told, std::vector<OdometerTick>& out) {
          const double v = value(c, told);
          if (given(v)) out.push_back({c.t(), v * k, speed});
        });
  std::vector<OdometerTick> out;
  double last = kNone;
  each_row(drive, "odometer", d, [&](const Channel& c) {
    const double v = value(c, d);
    if (!given(v)) return;
    if (given(last)) {
      double step = v - last;
      if (given(drive.odometer_wrap) && std::fabs(step) > 0.5 * drive.odometer_wrap)
        step -= std::copysign(drive.odometer_wrap, step);
      out.push_back({c.t(), step * k, false});
    } else {
      out.push_back({c.t(), 0.0, false});
    }
    last = v;
  });
  return out;
}

std::vector<AttitudeSample> read_attitude(const Drive& drive, Diagnostics& d) {
  std::vector<AttitudeSample> out;
  each_row(drive, "attitude", d, [&](const Channel& c) {
    AttitudeSample a{c.t(), c.value(c.at("heading")), c.value(c.at("pitch"), 0.0),
                     c.value(c.at("roll"), 0.0)};
    if (!given(a.heading)) {
      d.bad("bad_row", c.where(), "[attitude] expected a heading, found nan; row skipped");
      return;
    }
    out.push_back(a);
  });
  return out;
}

std::vector<Fix> read_fixes(const Drive& drive, Diagnostics& d) {
  return rows_in_order<Fix>(
      drive, "fix", d, [&](const Channel& c, Diagnostics& told, std::vector<Fix>& out) {
        Fix f;
        f.t = c.t();
        f.h = c.value(c.at("height"));
        if (c.has("lat") && c.has("lon")) {
          f.lat = c.value(c.at("lat"));
          f.lon = c.value(c.at("lon"));
        } else if (c.has("east") && c.has("north")) {
          if (!given(drive.fix.origin_lat))
            throw Error(ErrorKind::kInput,
                        "east and north columns need origin = { lat_deg = …, lon_deg = … }",
                        drive.fix.where + ".origin");
          const double e = c.value(c.at("east")), n = c.value(c.at("north")),
                       s = std::sin(drive.fix.origin_lat);
          f.lat =
              drive.fix.origin_lat + n / (meridian_radius(drive.ellipsoid, s) + drive.fix.origin_h);
          f.lon = wrap_pi(drive.fix.origin_lon +
                          e / ((prime_vertical_radius(drive.ellipsoid, s) + drive.fix.origin_h) *
                               std::cos(drive.fix.origin_lat)));
          if (c.has("up")) f.h = drive.fix.origin_h + c.value(c.at("up"));
        } else {
          throw Error(ErrorKind::kInput,
                      "missing; expected columns of lat and lon, or of east and north",
                      drive.fix.where + ".columns");
        }
        if (!given(f.lat) || !given(f.lon)) {
          told.bad("bad_row", c.where(), "[fix] expected a position, found nan; row skipped");
          return;
        }
        if (std::fabs(f.lat) > 0.5 * kPi + 1e-12) {
          told.bad("bad_row", c.where(), "[fix] latitude beyond 90 deg; row skipped");
          return;
        }
        f.std_e = c.value(c.at("std_e"), given(drive.fix_std) ? drive.fix_std : 0.0);
        f.std_n = c.value(c.at("std_n"), given(drive.fix_std) ? drive.fix_std : 0.0);
        f.std_u = c.value(c.at("std_u"), given(drive.fix_std) ? 2 * drive.fix_std : 0.0);
        f.ve = c.value(c.at("ve"));
        f.vn = c.value(c.at("vn"));
        f.vu = c.value(c.at("vu"));
        f.std_v = c.value(c.at("std_v"), drive.fix_velocity_std);
        for (const double x : {f.std_e, f.std_n, f.std_u, f.std_v})
          if (x < 0 || x > 1e8)
            throw Error(ErrorKind::kInput,
                        "[fix] expected a standard deviation of 0 or more and below 1e8 m, found " +
                            number(x) + " at t = " + number(f.t) + " s",
                        c.where());
        out.push_back(f);
      });
}

std::vector<HeadingSample> read_headings(const Drive& drive, Diagnostics& d) {
  if (!drive.heading.columns.contains("heading")) return {};  // rates or a path: read_track's
  return rows_in_order<HeadingSample>(
      drive, "heading", d, [&](const Channel& c, Diagnostics&, std::vector<HeadingSample>& out) {
        const HeadingSample s{
            c.t(), c.value(c.at("heading")),
            c.value(c.at("std"), given(drive.heading_std) ? drive.heading_std : 0.0)};
        if (given(s.heading)) out.push_back(s);
      });
}
std::vector<HeightSample> read_heights(const Drive& drive, Diagnostics& d) {
  return rows_in_order<HeightSample>(
      drive, "height", d, [&](const Channel& c, Diagnostics&, std::vector<HeightSample>& out) {
        const HeightSample s{c.t(), c.value(c.at("height")), c.value(c.at("rate"))};
        if (given(s.h)) out.push_back(s);
      });
}
std::vector<VelocitySample> read_velocities(const Drive& drive, Diagnostics& d) {
  const auto a = axes_to_rfu(drive.velocity_axes, drive.velocity.where + ".axes");
  return rows_in_order<VelocitySample>(
      drive, "velocity", d, [&](const Channel& c, Diagnostics&, std::vector<VelocitySample>& out) {
        VelocitySample s;
        s.t = c.t();
        if (c.has("velocity")) {
          const std::size_t at = c.at("velocity");
          const double* v = &c.values()[at];
          for (std::size_t i = 0; i < 3; ++i)
            s.v[i] = a[3 * i] * v[0] + a[3 * i + 1] * v[1] + a[3 * i + 2] * v[2];
        } else if (c.has("east") || c.has("north")) {
          s.level = true;
          s.v[0] = c.value(c.at("east"));
          s.v[1] = c.value(c.at("north"));
          s.v[2] = c.value(c.at("up"));
        } else {
          s.v[0] = c.value(c.at("right"));
          s.v[1] = c.value(c.at("forward"));
          s.v[2] = c.value(c.at("up"));
        }
        out.push_back(s);
      });
}

Solution read_reference(const Drive& drive, Diagnostics& d) {
  if (!drive.reference.present)
    throw Error(ErrorKind::kInput, "the drive has no [reference]", drive.toml_path);
  Solution out;
  out.meta["ellipsoid"] = drive.ellipsoid.name;
  each_row(drive, "reference", d, [&](const Channel& c) {
    SolutionRow r;
    r.t = c.t();
    auto get = [&](const char* key) { return c.value(c.at(key)); };
    r.lat = get("lat"), r.lon = get("lon"), r.h = c.value(c.at("height"), 0.0);
    r.ve = get("ve"), r.vn = get("vn"), r.vu = get("vu");
    r.roll = get("roll"), r.pitch = get("pitch"), r.heading = get("heading");
    r.qw = get("qw"), r.qx = get("qx"), r.qy = get("qy"), r.qz = get("qz");
    r.x = get("x"), r.y = get("y"), r.z = get("z");
    if (!given(r.lat) && !given(r.x) && c.has("east") && given(drive.reference.origin_lat)) {
      const double s = std::sin(drive.reference.origin_lat), h = drive.reference.origin_h;
      r.lat = drive.reference.origin_lat + get("north") / (meridian_radius(drive.ellipsoid, s) + h);
      r.lon = wrap_pi(drive.reference.origin_lon +
                      get("east") / ((prime_vertical_radius(drive.ellipsoid, s) + h) *
                                     std::cos(drive.reference.origin_lat)));
    }
    complete_row(r, drive.ellipsoid);
    out.rows.push_back(r);
  });
  return out;
}

}  // namespace loxo
