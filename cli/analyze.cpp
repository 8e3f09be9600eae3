// SPDX-License-Identifier: Apache-2.0
// `loxo analyze`: how errors move. static: the exact response of a system at rest; roots: its
// characteristic roots. Others have a file of their own.
#include <fmt/format.h>

#include <cmath>
#include <iostream>
#include <memory>

#include "cli/analyze.hpp"
#include "cli/table.hpp"
#include "loxo/earth/transverse.hpp"
#include "loxo/errors/static_response.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/csv.hpp"

namespace loxo::cli {
namespace {

struct Options {
  std::string earth = "WGS84", table, frame = "transverse", lat, lon, meridian = "0deg";
  std::string duration = "24h", step = "60s";
  bool neglect_foucault = false;
  // Sources, with their units.
  std::string gyro_bias, accel_bias, tilt, position, velocity, gyro_noise, accel_noise;
};

Ellipsoid earth_of(const Options& o) {
  try {
    return o.earth == "sphere" ? paper_sphere() : ellipsoid_by_name(o.earth);
  } catch (const Error& e) {
    throw Error(ErrorKind::kUsage, e.what(), "--earth");
  }
}

int run_static_table(const Globals& globals, const Options& o) {
  const auto ell = std::make_shared<Ellipsoid>(earth_of(o));
  const bool neglect = o.neglect_foucault;
  return run_table(globals, "analyze static", o.table, [ell, neglect](const TableHeader&) {
    TableJob job;
    job.inputs = {"tlat_deg",     "tlon_deg",     "t_s",         "dve0_mps",    "dvn0_mps",
                  "phie0_rad",    "phin0_rad",    "phiu0_rad",   "dtlat0_rad",  "dtlon0_rad",
                  "nabla_e_mps2", "nabla_n_mps2", "eps_e_radps", "eps_n_radps", "eps_u_radps"};
    job.outputs = {"dve_mps",  "dvn_mps",   "phie_rad", "phin_rad",
                   "phiu_rad", "dtlat_rad", "dtlon_rad"};
    job.row = [ell, neglect](std::span<const double> in, std::span<double> out) -> std::string {
      if (std::fabs(in[0]) > 90.0) return bad_latitude("tlat_deg", in[0]);
      try {
        auto site = transverse_site(*ell, in[0] * deg, in[1] * deg);
        site.neglect_foucault = neglect;
        const StaticInputs x{in[3], in[4],  in[5],  in[6],  in[7],  in[8],
                             in[9], in[10], in[11], in[12], in[13], in[14]};
        const auto y = static_response(site, x).at(in[2]);
        std::copy(y.begin(), y.end(), out.begin());
      } catch (const Error& e) {
        return e.what();
      }
      return {};
    };
    return job;
  });
}

StaticSite site_of(const Options& o, const Ellipsoid& ell) {
  if (o.lat.empty())
    throw Error(ErrorKind::kUsage,
                "where does the system stand? --lat (and --lon) with a unit, or --table FILE",
                "--lat");
  const double lat = option_quantity(o.lat, Dimension::kAngle, "--lat");
  const double lon = o.lon.empty() ? 0.0 : option_quantity(o.lon, Dimension::kAngle, "--lon");
  const double lon0 = option_quantity(o.meridian, Dimension::kAngle, "--meridian");
  if (!(std::fabs(lat) <= 90 * deg))
    throw Error(ErrorKind::kUsage, "latitude within +-90 deg expected, found " + o.lat, "--lat");
  require_one_of(o.frame, {"transverse", "grid", "wander", "geographic"}, "--frame");
  const auto t = to_transverse(lat, lon, lon0);
  StaticSite site;
  if (o.frame == "transverse") {
    site = transverse_site(ell, t.tlat, t.tlon);
  } else if (o.frame == "grid") {
    site = grid_site(ell, t.tlat, t.tlon);
  } else if (o.frame == "geographic") {
    site = geographic_site(ell, lat);
  } else {
    site = wander_site(ell, lat, 0.0);
  }
  site.neglect_foucault = o.neglect_foucault;
  return site;
}

int run_static(const Globals& globals, const Options& o) {
  if (!o.table.empty()) return run_static_table(globals, o);
  const Ellipsoid ell = earth_of(o);
  const auto site = site_of(o, ell);
  const double duration = option_quantity(o.duration, Dimension::kTime, "--duration");
  const double step = option_quantity(o.step, Dimension::kTime, "--step");
  if (!(duration > 0 && step > 0 && duration / step <= 1e7))
    throw Error(ErrorKind::kUsage, "a positive duration and step expected, at most 1e7 steps",
                "--step");
  const auto size = [&](const std::string& text, Dimension d, const char* option) {
    const double x = text.empty() ? 0.0 : option_quantity(text, d, option);
    if (!std::isfinite(x)) throw Error(ErrorKind::kUsage, "a finite number expected", option);
    return x;
  };
  const auto noise = [&](const std::string& text, Dimension d, const char* option) {
    const double x = size(text, d, option);
    if (x < 0)
      throw Error(ErrorKind::kUsage, "noise is never negative: at least 0 expected, found " + text,
                  option);
    return x;
  };
  const double gyro = size(o.gyro_bias, Dimension::kAngularRate, "--gyro-bias");
  const double accel = size(o.accel_bias, Dimension::kAcceleration, "--accel-bias");
  const double tilt = size(o.tilt, Dimension::kAngle, "--tilt");
  const double position = size(o.position, Dimension::kLength, "--position");
  const double velocity = size(o.velocity, Dimension::kSpeed, "--velocity");

  // One response a source: the same error on each axis in turn.
  struct Source {
    std::string name;
    StaticInputs in;
  };
  std::vector<Source> sources;
  const auto add = [&](const char* name, double StaticInputs::*slot, double value) {
    if (value == 0.0) return;
    StaticInputs in;
    in.*slot = value;
    sources.push_back({name, in});
  };
  add("gyro_e", &StaticInputs::eps_e, gyro);
  add("gyro_n", &StaticInputs::eps_n, gyro);
  add("gyro_u", &StaticInputs::eps_u, gyro);
  add("accel_e", &StaticInputs::nabla_e, accel);
  add("accel_n", &StaticInputs::nabla_n, accel);
  add("tilt_e", &StaticInputs::phie0, tilt);
  add("tilt_n", &StaticInputs::phin0, tilt);
  add("tilt_u", &StaticInputs::phiu0, tilt);
  add("velocity_e", &StaticInputs::dve0, velocity);
  add("velocity_n", &StaticInputs::dvn0, velocity);
  add("position_n", &StaticInputs::dlat0, position * std::sqrt(site.kee * site.knn));
  add("position_e", &StaticInputs::dlon0, position * std::sqrt(site.kee * site.knn) / site.cos_lat);
  const double gyro_noise = noise(o.gyro_noise, Dimension::kAngleRandomWalk, "--gyro-noise");
  const double accel_noise = noise(o.accel_noise, Dimension::kVelocityRandomWalk, "--accel-noise");
  if (sources.empty() && gyro_noise == 0 && accel_noise == 0)
    throw Error(ErrorKind::kUsage,
                "no error given: --gyro-bias 0.001deg/h, --accel-bias 10ug, --tilt 30arcsec, "
                "--velocity 0.01m/s, --position 10m, --gyro-noise '0.001deg/sqrt(h)', "
                "--accel-noise 5ug/sqrt(Hz)");
  StaticInputs all;
  for (const auto& s : sources) {
    all.eps_e += s.in.eps_e, all.eps_n += s.in.eps_n, all.eps_u += s.in.eps_u;
    all.nabla_e += s.in.nabla_e, all.nabla_n += s.in.nabla_n;
    all.phie0 += s.in.phie0, all.phin0 += s.in.phin0, all.phiu0 += s.in.phiu0;
    all.dve0 += s.in.dve0, all.dvn0 += s.in.dvn0, all.dlat0 += s.in.dlat0, all.dlon0 += s.in.dlon0;
  }
  if (!sources.empty()) sources.insert(sources.begin(), {"sum", all});

  std::vector<StaticResponse> responses;
  for (const auto& s : sources) responses.push_back(static_response(site, s.in));
  const auto n = static_cast<std::size_t>(std::floor(duration / step + 1e-9)) + 1;
  Json json;
  json["command"] = "analyze static";
  json["frame"] = o.frame;
  json["earth"] = ell.name;
  const auto roots = static_roots(site);
  json["roots_radps"] = {roots.earth, roots.low, roots.high};
  Json table = Json::array();
  if (!globals.quiet && !globals.json && globals.output != "-")
    say(globals,
        fmt::format("{:<12}{:>14}{:>14}{:>12}{:>12}{:>12}{:>14}", "largest of", "north [m]",
                    "east [m]", "dv [m/s]", "level ['']", "azimuth ['']", "end [m]"));
  for (std::size_t k = 0; k < responses.size(); ++k) {
    double north = 0, east = 0, dv = 0, level = 0, azimuth = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double t = step * static_cast<double>(i);
      const auto x = responses[k].at(t);
      const auto p = responses[k].position(t);
      north = std::max(north, std::fabs(p[0]));
      east = std::max(east, std::fabs(p[1]));
      dv = std::max(dv, std::hypot(x[0], x[1]));
      level = std::max(level, std::hypot(x[2], x[3]));
      azimuth = std::max(azimuth, std::fabs(x[4]));
    }
    const auto end = responses[k].position(duration);
    table.push_back({{"source", sources[k].name},
                     {"north_max_m", north},
                     {"east_max_m", east},
                     {"velocity_max_mps", dv},
                     {"level_max_arcsec", level / arcsec},
                     {"azimuth_max_arcsec", azimuth / arcsec},
                     {"north_end_m", end[0]},
                     {"east_end_m", end[1]}});
    if (globals.output != "-")
      say(globals, fmt::format("{:<12}{:>14.4g}{:>14.4g}{:>12.4g}{:>12.4g}{:>12.4g}{:>14.4g}",
                               sources[k].name, north, east, dv, level / arcsec, azimuth / arcsec,
                               std::hypot(end[0], end[1])));
  }
  json["sources"] = table;
  if (!globals.output.empty() && !globals.output.ends_with(".json")) {
    std::vector<std::array<std::vector<double>, 7>> series(responses.size());
    static_series(responses, 0.0, step, n, series);
    OutputFile file(globals.output);
    std::string text =
        "t_s,source,dve_mps,dvn_mps,phie_rad,phin_rad,phiu_rad,dlat_rad,dlon_rad,north_m,east_m\n";
    for (std::size_t k = 0; k < responses.size(); ++k)
      for (std::size_t i = 0; i < n; ++i) {
        const double t = step * static_cast<double>(i);
        append_number(text, t);
        text += "," + sources[k].name;
        for (const auto& component : series[k]) {
          text += ',';
          append_number(text, component[i]);
        }
        for (double p : responses[k].position(t)) {
          text += ',';
          append_number(text, p);
        }
        text += '\n';
        if (text.size() > (1u << 20)) {
          file.write(text);
          text.clear();
        }
      }
    file.write(text);
    file.commit();
  }
  // Curves for the report: at most 600 points each.
  const std::size_t thin = std::max<std::size_t>(1, (n + 599) / 600);
  std::vector<double> times;
  for (std::size_t i = 0; i < n; i += thin) times.push_back(step * static_cast<double>(i));
  json["t_s"] = times;
  Json curves = Json::array();
  for (std::size_t k = 0; k < responses.size(); ++k) {
    std::vector<double> c[7];
    for (const double t : times) {
      const auto x = responses[k].at(t);
      const auto m = responses[k].position(t);
      const double v[7] = {m[0], m[1], x[0], x[1], x[2] / arcsec, x[3] / arcsec, x[4] / arcsec};
      for (int i = 0; i < 7; ++i) c[i].push_back(v[i]);
    }
    curves.push_back({{"source", sources[k].name},
                      {"north_m", c[0]},
                      {"east_m", c[1]},
                      {"dve_mps", c[2]},
                      {"dvn_mps", c[3]},
                      {"phie_arcsec", c[4]},
                      {"phin_arcsec", c[5]},
                      {"phiu_arcsec", c[6]}});
  }
  json["responses"] = curves;
  // White noise: standard deviations, exactly.
  Json random = Json::array();
  const std::pair<const char*, std::array<double, 2>> kinds[] = {
      {"gyro_noise", {0, gyro_noise * gyro_noise}},
      {"accel_noise", {accel_noise * accel_noise, 0}}};
  for (const auto& [name, q] : kinds) {
    if (q[0] + q[1] == 0) continue;
    const auto p = static_noise_covariance(site, q[0], q[1], duration);
    const double radius = 1 / std::sqrt(site.kee * site.knn);
    const double north = radius * std::sqrt(p[40]), east = radius * site.cos_lat * std::sqrt(p[48]);
    random.push_back({{"source", name},
                      {"north_std_end_m", north},
                      {"east_std_end_m", east},
                      {"dve_std_end_mps", std::sqrt(p[0])},
                      {"dvn_std_end_mps", std::sqrt(p[8])},
                      {"phie_std_end_arcsec", std::sqrt(p[16]) / arcsec},
                      {"phin_std_end_arcsec", std::sqrt(p[24]) / arcsec},
                      {"phiu_std_end_arcsec", std::sqrt(p[32]) / arcsec}});
    if (globals.output != "-")
      say(globals,
          fmt::format("{:<12} at the end, 1 sigma: north {:.4g} m, east {:.4g} m, velocity "
                      "{:.4g} m/s, level {:.3g}'', azimuth {:.3g}''",
                      name, north, east, std::sqrt(p[0] + p[8]), std::sqrt(p[16] + p[24]) / arcsec,
                      std::sqrt(p[32]) / arcsec));
  }
  if (!random.empty()) json["noise"] = random;
  if (!globals.output.empty() && globals.output.ends_with(".json")) {
    OutputFile file(globals.output);
    file.write(dump_json(json) + "\n");
    file.commit();
  }
  if (globals.json) print_json(json);
  return 0;
}

int run_roots(const Globals& globals, const Options& o) {
  const Ellipsoid ell = earth_of(o);
  const auto site = site_of(o, ell);
  const auto roots = static_roots(site);
  Json json;
  json["command"] = "analyze roots";
  json["earth"] = ell.name;
  json["zero"] = 0.0;
  json["earth_rate_radps"] = roots.earth;
  json["schuler_foucault_low_radps"] = roots.low;
  json["schuler_foucault_high_radps"] = roots.high;
  Json list = Json::array({{{"name", "zero"}, {"re", 0.0}, {"im", 0.0}}});
  const std::pair<const char*, double> named[] = {{"Earth rate", roots.earth},
                                                  {"Schuler-Foucault low", roots.low},
                                                  {"Schuler-Foucault high", roots.high}};
  for (const auto& [name, im] : named)
    for (double sign : {1.0, -1.0})
      list.push_back({{"name", name}, {"re", 0.0}, {"im", sign * im}});
  json["roots"] = list;
  json["foucault_radps"] = site.neglect_foucault ? 0.0 : site.w * site.u[2];
  if (!globals.output.empty()) {
    OutputFile file(globals.output);
    std::string csv = "name,re_1_s,im_1_s\n";
    for (const auto& r : list) {
      csv += r["name"].get<std::string>() + ",0,";
      append_number(csv, r["im"].get<double>());
      csv += '\n';
    }
    file.write(globals.output.ends_with(".json") ? dump_json(json) + "\n" : csv);
    file.commit();
  }
  if (globals.json) {
    print_json(json);
    return 0;
  }
  const auto line = [&](const char* name, double x) {
    say(globals,
        fmt::format("  {:<22} +-j {:.12g} rad/s   period {:.6g} min", name, x, 2 * kPi / x / 60));
  };
  say(globals, fmt::format("characteristic roots on {} (and zero):", ell.name));
  line("Earth rate", roots.earth);
  line("Schuler-Foucault low", roots.low);
  line("Schuler-Foucault high", roots.high);
  return 0;
}

void add_site_options(CLI::App* sub, const std::shared_ptr<Options>& o) {
  sub->add_option("--earth", o->earth, "sphere (R 6371000 m, g 9.8 m/s^2) or an ellipsoid");
  sub->add_option("--lat", o->lat, "latitude, as 89.9deg");
  sub->add_option("--lon", o->lon, "longitude, as 45deg");
  sub->add_option("--meridian", o->meridian,
                  "reference meridian of the transverse and grid frames");
  sub->add_option("--frame", o->frame, "transverse, grid, wander, geographic");
  sub->add_flag("--neglect-foucault", o->neglect_foucault, "the papers' form");
}

}  // namespace

void add_analyze(CLI::App& app, Globals& globals) {
  auto* analyze = add_command(
      app, globals, "analyze",
      "error propagation: exact responses at rest, roots, budgets, calibration drives",
      "loxo analyze static --lat 89.9deg --lon 45deg --gyro-bias 0.001deg/h", []() -> int {
        throw Error(ErrorKind::kUsage, "analyze what? static, roots, budget, odometer, noise",
                    "analyze");
      });
  auto o = std::make_shared<Options>();
  auto* rest = add_subcommand(
      *analyze, globals, "static", "the exact response of an inertial system at rest",
      "loxo analyze static --lat 89.9deg --lon 45deg --gyro-bias 0.001deg/h -o response.csv",
      [&globals, o]() -> int { return run_static(globals, *o); });
  add_site_options(rest, o);
  rest->add_option("--table", o->table,
                   "one case a row ('-': standard input); columns as documented");
  rest->add_option("--duration", o->duration, "how long, as 24h");
  rest->add_option("--step", o->step, "row distance of -o, as 60s");
  rest->add_option("--gyro-bias", o->gyro_bias, "on each axis in turn, as 0.001deg/h");
  rest->add_option("--accel-bias", o->accel_bias, "on each horizontal axis in turn, as 10ug");
  rest->add_option("--tilt", o->tilt, "initial misalignment on each axis in turn, as 30arcsec");
  rest->add_option("--velocity", o->velocity, "initial velocity error, as 0.01m/s");
  rest->add_option("--position", o->position, "initial position error, as 10m");
  rest->add_option("--gyro-noise", o->gyro_noise, "white, as 0.001deg/sqrt(h): 1 sigma at the end");
  rest->add_option("--accel-noise", o->accel_noise, "white, as 5ug/sqrt(Hz)");
  auto r = std::make_shared<Options>();
  auto* roots = add_subcommand(*analyze, globals, "roots",
                               "characteristic roots of an inertial system at rest",
                               "loxo analyze roots --lat 30deg --earth sphere",
                               [&globals, r]() -> int { return run_roots(globals, *r); });
  add_site_options(roots, r);
  add_analyze_noise(*analyze, globals);
  add_analyze_budget(*analyze, globals);
  add_analyze_odometer(*analyze, globals);
}

}  // namespace loxo::cli
