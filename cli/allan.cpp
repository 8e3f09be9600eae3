// SPDX-License-Identifier: Apache-2.0
// `loxo allan`: Allan deviation of a log at rest and the noise coefficients behind it, in
// data-sheet units.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>

#include "cli/command.hpp"
#include "loxo/errors/allan.hpp"
#include "loxo/log/drive.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/csv.hpp"

namespace loxo::cli {
namespace {

struct Options {
  std::string log, kind = "allan", tau_max, rate, gyro_unit, accel_unit;
  bool increments = false, errors = false;
};

// What one unit of a table's columns is, SI; increments are angles and velocities over a sample.
struct Factors {
  double gyro = 1, accel = 1;
};
Factors factors_of(const Options& o) {
  Factors f;
  if (!o.gyro_unit.empty())
    f.gyro = option_quantity(
        o.gyro_unit, o.increments ? Dimension::kAngle : Dimension::kAngularRate, "--gyro-unit");
  if (!o.accel_unit.empty())
    f.accel = option_quantity(
        o.accel_unit, o.increments ? Dimension::kSpeed : Dimension::kAcceleration, "--accel-unit");
  if (!(f.gyro > 0 && f.accel > 0))
    throw Error(ErrorKind::kUsage, "the unit of a column is above 0, as 0.05deg/s", "--gyro-unit");
  return f;
}

struct Axis {
  std::string name;
  bool gyro = true;
  AllanStream stream;
  double first = 0, last = 0;  // means of the first and last tenth, for "not at rest"
};

// A drive (its [imu]) or a table with gx gy gz ax ay az and t_s, or a rate instead of it.
double read_into(const Options& o, AllanKind kind, std::vector<Axis>& axes,
                 Diagnostics& diagnostics, double& spread) {
  const std::string& path = o.log;
  const Factors unit = factors_of(o);
  const double rate = o.rate.empty() ? 0 : option_quantity(o.rate, Dimension::kFrequency, "--rate");
  if (!o.rate.empty() && !(rate > 0 && std::isfinite(rate)))
    throw Error(ErrorKind::kUsage, "a rate above 0 expected, as 100Hz", "--rate");
  namespace fs = std::filesystem;
  std::vector<double> batch[6];
  double interval = 0, previous = 0, norm_sum = 0, norm_square = 0;
  std::size_t count = 0;
  const bool drive_given =
      fs::is_directory(path) || path.ends_with(".toml") || path.ends_with(".h5");
  std::vector<int> channel;
  const auto flush = [&] {
    for (std::size_t i = 0; i < axes.size(); ++i)
      axes[i].stream.add(batch[static_cast<std::size_t>(channel[i])]);
    for (auto& b : batch) b.clear();
  };
  const auto start = [&](double dt, const std::vector<int>& present) {
    static const char* const kName[6] = {"gyro_x",  "gyro_y",  "gyro_z",
                                         "accel_x", "accel_y", "accel_z"};
    channel = present;
    for (int c : present) axes.push_back({kName[c], c < 3, AllanStream(dt, kind)});
  };
  const auto take = [&](const double(&v)[6]) {
    for (int c = 0; c < 6; ++c) batch[c].push_back(v[c]);
    const double f = std::sqrt(v[3] * v[3] + v[4] * v[4] + v[5] * v[5]);
    norm_sum += f;
    norm_square += f * f;
    ++count;
    if (batch[0].size() == 4096) flush();
  };
  if (drive_given) {
    if (!o.rate.empty() || !o.gyro_unit.empty() || !o.accel_unit.empty() || o.increments)
      throw Error(ErrorKind::kUsage,
                  "a drive says its own rate and units: --rate, --gyro-unit, --accel-unit and "
                  "--increments are for tables",
                  path);
    const Drive drive = read_drive(path);
    if (!drive.imu.present) throw Error(ErrorKind::kInput, "the drive has no [imu] section", path);
    ImuReader reader(drive, diagnostics);
    interval = reader.interval();
    start(interval, {0, 1, 2, 3, 4, 5});
    ImuIncrement<double> s;
    while (reader.next(s)) {
      const double k = 1.0 / s.dt;
      take({s.dtheta.x * k, s.dtheta.y * k, s.dtheta.z * k, s.dv.x * k, s.dv.y * k, s.dv.z * k});
    }
  } else {
    CsvReader reader(path);
    // Without a time column the rate must be given.
    const bool timed = reader.has("t_s");
    if (!timed && rate == 0)
      throw Error(ErrorKind::kInput, "no column t_s: give the rate of the samples, as --rate 100Hz",
                  path);
    std::vector<std::string> columns;
    if (timed) columns.push_back("t_s");
    std::vector<int> present;
    static const char* const kColumn[6] = {"gx", "gy", "gz", "ax", "ay", "az"};
    for (int c = 0; c < 6; ++c)
      if (reader.has(kColumn[c])) {
        columns.push_back(kColumn[c]);
        present.push_back(c);
      }
    if (present.empty()) reader.index("gx");  // throws, naming what was found
    reader.select(columns);
    std::vector<double> row(columns.size());
    std::vector<std::array<double, 6>> head;
    std::vector<double> steps;
    std::size_t gaps = 0, rows = 0;
    if (rate > 0) {
      interval = 1.0 / rate;
      start(interval, present);
    }
    // Increments are divided by the nominal interval.
    const auto scaled = [&](const std::array<double, 6>& h) {
      const double per = o.increments ? 1.0 / interval : 1.0;
      const double g = unit.gyro * per, a = unit.accel * per;
      take({h[0] * g, h[1] * g, h[2] * g, h[3] * a, h[4] * a, h[5] * a});
    };
    while (reader.next(row, diagnostics)) {
      if (std::any_of(row.begin(), row.end(), [](double x) { return !std::isfinite(x); })) {
        diagnostics.bad("nan", path + ":" + std::to_string(reader.line()),
                        "a number expected in every column used; row left out");
        continue;
      }
      std::array<double, 6> v{};
      for (std::size_t i = 0; i < present.size(); ++i)
        v[static_cast<std::size_t>(present[i])] = row[i + (timed ? 1 : 0)];
      ++rows;
      if (!timed) {
        scaled(v);
        continue;
      }
      if (interval == 0) {
        // The nominal interval is the median of the first thousand steps; until then rows wait.
        if (!head.empty()) steps.push_back(row[0] - previous);
        head.push_back(v);
        previous = row[0];
        if (steps.size() == 1000) {
          std::nth_element(steps.begin(), steps.begin() + 500, steps.end());
          interval = steps[500];
          if (!(interval > 0))
            throw Error(ErrorKind::kInput,
                        "time must increase; the median step is " + std::to_string(interval) + " s",
                        path);
          start(interval, present);
          for (const auto& h : head) scaled(h);
        }
        continue;
      }
      if (rows > 1 && row[0] <= previous) {
        diagnostics.bad("time_back", path + ":" + std::to_string(reader.line()),
                        "time does not increase; row left out");
        continue;
      }
      if (rows > 1 && row[0] - previous > 1.5 * interval && gaps++ < 1000000)
        diagnostics.warn(
            "gap", path + ":" + std::to_string(reader.line()),
            fmt::format(
                "{:.6g} s without samples, taken as contiguous; averaging times beyond it suffer",
                row[0] - previous));
      previous = row[0];
      scaled(v);
    }
    if (interval == 0)
      throw Error(ErrorKind::kInput,
                  fmt::format("at least 1001 rows expected, found {}", head.size()), path);
  }
  flush();
  if (count > 0) {
    const double mean = norm_sum / static_cast<double>(count);
    spread = std::sqrt(std::max(0.0, norm_square / static_cast<double>(count) - mean * mean));
  }
  return interval;
}

// A fit that departs further from its curve (relative rms) describes something else.
constexpr double kUsable = 0.2;

// The worst usable axis of each kind, for [imu] errors.
struct Found {
  struct Sensor {
    double noise = 0, bias = 0, tau = 0;
    int axes = 0, seen = 0;
  } gyro, accel;
};
std::string errors_line(const Found& f) {
  std::string text;
  const auto add = [&](const char* key, double x, const char* unit) {
    if (x > 0) text += fmt::format("{}{} = \"{:.4g} {}\"", text.empty() ? "" : ", ", key, x, unit);
  };
  add("gyro_noise", f.gyro.noise / deg_per_sqrt_h, "deg/sqrt(h)");
  add("gyro_bias", f.gyro.bias / deg_per_h, "deg/h");
  if (f.gyro.bias > 0) add("gyro_bias_tau", f.gyro.tau, "s");
  add("accel_noise", f.accel.noise / mps_per_sqrt_h, "m/s/sqrt(h)");
  add("accel_bias", f.accel.bias / ug, "ug");
  if (f.accel.bias > 0) add("accel_bias_tau", f.accel.tau, "s");
  return "errors = { " + text + " }";
}

int run(const Globals& globals, const Options& o) {
  AllanKind kind = AllanKind::kAllan;
  if (o.kind == "modified")
    kind = AllanKind::kModified;
  else if (o.kind == "hadamard")
    kind = AllanKind::kHadamard;
  else if (o.kind != "allan")
    require_one_of(o.kind, {"allan", "modified", "hadamard"}, "--kind");
  if (o.errors && kind != AllanKind::kAllan)
    throw Error(ErrorKind::kUsage, "the fit is made on the Allan deviation: --kind allan expected",
                "--errors");
  const double tau_max =
      o.tau_max.empty() ? 1e300 : option_quantity(o.tau_max, Dimension::kTime, "--tau-max");
  Diagnostics diagnostics;
  std::vector<Axis> axes;
  double spread = 0;
  const double dt = read_into(o, kind, axes, diagnostics, spread);
  if (spread > 0.5)
    diagnostics.warn("not_at_rest", o.log,
                     fmt::format("the specific force scatters by {:.3g} m/s^2 rms: this log does "
                                 "not look at rest, coefficients describe the motion too",
                                 spread));

  Found found;
  Json json;
  json["command"] = "allan";
  json["kind"] = o.kind;
  json["interval_s"] = dt;
  json["samples"] = axes[0].stream.samples();
  Json result = Json::object();
  std::string csv = "axis,tau_s,deviation,deviation_std,windows\n";
  if (!o.errors)
    say(globals, fmt::format("{} samples at {:.6g} Hz ({:.4g} h)", axes[0].stream.samples(), 1 / dt,
                             static_cast<double>(axes[0].stream.samples()) * dt / 3600));
  for (auto& axis : axes) {
    auto points = axis.stream.points(4);
    if (!o.tau_max.empty() && (points.empty() || points.back().tau < 0.5 * tau_max))
      throw Error(ErrorKind::kInput,
                  fmt::format("the log of {:.6g} s is shorter than the asked averaging times: it "
                              "allows up to {:.4g} s, --tau-max asks for {:.6g} s",
                              static_cast<double>(axis.stream.samples()) * dt,
                              points.empty() ? 0.0 : points.back().tau, tau_max),
                  o.log);
    points.erase(std::remove_if(points.begin(), points.end(),
                                [&](const AllanPoint& p) { return p.tau > tau_max; }),
                 points.end());
    if (points.size() < 6)
      throw Error(ErrorKind::kInput,
                  fmt::format("the log is too short: {} averaging times fit, at least 6 are needed",
                              points.size()),
                  o.log);
    Json a;
    a["mean"] = axis.stream.mean();
    AllanFit fit;
    if (kind == AllanKind::kAllan) {
      fit = fit_allan(points, dt, axis.stream.samples());
      const auto put = [&](const char* name, int index, double unit) {
        a[name] = fit.value[static_cast<std::size_t>(index)] / unit;
        a[std::string(name) + "_std"] = fit.std[static_cast<std::size_t>(index)] / unit;
      };
      if (axis.gyro) {
        put("angle_random_walk_deg_sqrt_h", AllanFit::kRandomWalk, deg_per_sqrt_h);
        put("bias_instability_deg_h", AllanFit::kBiasInstability, deg_per_h);
        put("rate_random_walk_deg_h_sqrt_h", AllanFit::kRateRandomWalk, deg_per_h / 60.0);
        put("quantisation_arcsec", AllanFit::kQuantisation, arcsec);
        put("rate_ramp_deg_h_h", AllanFit::kRamp, deg_per_h / hour);
      } else {
        put("velocity_random_walk_mps_sqrt_h", AllanFit::kRandomWalk, mps_per_sqrt_h);
        put("bias_instability_ug", AllanFit::kBiasInstability, ug);
        put("acceleration_random_walk_mps2_sqrt_h", AllanFit::kRateRandomWalk, 1.0 / 60.0);
        put("quantisation_mps", AllanFit::kQuantisation, 1.0);
        put("ramp_mps2_h", AllanFit::kRamp, 1.0 / hour);
      }
      a["chi2"] = fit.chi2;
      a["dof"] = fit.dof;
      a["model_error"] = fit.model_error;
      // Where the curve leaves the five noises furthest: evidence of motion, vibration, a filter.
      double furthest = 0, at_tau = 0;
      std::size_t lowest = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        if (points[i].deviation < points[lowest].deviation) lowest = i;
        const double model = allan_deviation(fit, points[i].tau);
        const double off = model > 0 ? points[i].deviation / model - 1 : 0;
        if (std::fabs(off) > std::fabs(furthest)) furthest = off, at_tau = points[i].tau;
      }
      const bool usable = fit.model_error < kUsable;
      a["usable"] = usable;
      std::string why;
      if (!usable) {
        why = fmt::format(
            "the curve departs from the five noises by {:.0f} % rms, most at {:.3g} s ({:+.0f} %): "
            "{}",
            100 * fit.model_error, at_tau, 100 * furthest,
            furthest > 0 ? "the sensor moves or vibrates there, or its samples are correlated"
                         : "its samples are correlated");
        diagnostics.warn("not_at_rest", axis.name, why);
      }
      a["why"] = why;
      auto& all = axis.gyro ? found.gyro : found.accel;
      if (usable) {
        all.noise = std::max(all.noise, fit.value[AllanFit::kRandomWalk]);
        const double b = fit.value[AllanFit::kBiasInstability];
        if (b > all.bias) all.bias = b, all.tau = points[lowest].tau;
        ++all.axes;
      }
      ++all.seen;
      const auto v = [&](int i, double unit) {
        return fmt::format("{:.4g} +- {:.2g}", fit.value[static_cast<std::size_t>(i)] / unit,
                           fit.std[static_cast<std::size_t>(i)] / unit);
      };
      if (o.errors) {
        // Only the line.
      } else if (axis.gyro)
        say(globals, fmt::format("  {:<8} angle random walk {} deg/sqrt(h)   bias instability {} "
                                 "deg/h   rate random walk {} deg/h/sqrt(h)",
                                 axis.name, v(AllanFit::kRandomWalk, deg_per_sqrt_h),
                                 v(AllanFit::kBiasInstability, deg_per_h),
                                 v(AllanFit::kRateRandomWalk, deg_per_h / 60.0)));
      else
        say(globals,
            fmt::format("  {:<8} velocity random walk {} m/s/sqrt(h)   bias instability {} ug",
                        axis.name, v(AllanFit::kRandomWalk, mps_per_sqrt_h),
                        v(AllanFit::kBiasInstability, ug)));
    }
    Json list = Json::array();
    for (const auto& p : points) {
      list.push_back({{"tau_s", p.tau},
                      {"deviation", p.deviation},
                      {"deviation_std", p.deviation_std},
                      {"windows", p.windows}});
      if (kind == AllanKind::kAllan) list.back()["fit"] = allan_deviation(fit, p.tau);
      csv += axis.name;
      for (double x : {p.tau, p.deviation, p.deviation_std, static_cast<double>(p.windows)}) {
        csv += ',';
        append_number(csv, x);
      }
      csv += '\n';
    }
    a["points"] = list;
    result[axis.name] = a;
  }
  json["axes"] = result;
  if (kind == AllanKind::kAllan && found.gyro.axes + found.accel.axes > 0) {
    const std::string line = errors_line(found);
    json["errors"] = line;
    if (o.errors && !globals.json) fmt::print("{}\n", line);
  } else if (o.errors) {
    throw Error(ErrorKind::kInput, "no axis is usable: nothing to declare", o.log);
  }
  json["diagnostics"] = to_json(diagnostics);
  if (!globals.output.empty()) {
    OutputFile file(globals.output);
    file.write(globals.output.ends_with(".json") ? dump_json(json) + "\n" : csv);
    file.commit();
  }
  if (globals.json) print_json(json);
  print_diagnostics(globals, diagnostics);
  return 0;
}

}  // namespace

void add_allan(CLI::App& app, Globals& globals) {
  auto o = std::make_shared<Options>();
  auto* sub = add_command(
      app, globals, "allan",
      "Allan deviation of a log at rest, noise coefficients with their errors, in data-sheet units",
      "loxo allan imu.csv.gz --json", [&globals, o]() -> int { return run(globals, *o); });
  sub->add_option("LOG", o->log,
                  "a drive, or a table with t_s,gx,gy,gz,ax,ay,az (SI unless units are given)")
      ->required();
  sub->add_option("--kind", o->kind, "allan (with fit), modified, hadamard");
  sub->add_option("--rate", o->rate, "of a table's rows, as 100Hz; without: column t_s");
  sub->add_option("--gyro-unit", o->gyro_unit, "one count of gx gy gz, as 0.05deg/s");
  sub->add_option("--accel-unit", o->accel_unit, "one count of ax ay az, as 0.00333g");
  sub->add_flag("--increments", o->increments, "the table holds angle and velocity increments");
  sub->add_flag("--errors", o->errors, "print the line that drops into [imu] of a drive.toml");
  sub->add_option("--tau-max", o->tau_max, "longest averaging time, as 1000s");
}

}  // namespace loxo::cli
