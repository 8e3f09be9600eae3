// SPDX-License-Identifier: Apache-2.0
// `loxo calibrate points`: two-point calibration on a CSV table, one case a row.
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "cli/calibrate.hpp"
#include "cli/table.hpp"
#include "loxo/calibrate/two_point.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo::cli {
namespace {

struct Options {
  std::string file = "-";
  std::string method = "rhumb";
  std::string ellipsoid = "WGS84";
  std::string std;
};

// Names are written with hyphens on the command line and with underscores in columns and keys.
std::string hyphens(std::string name) {
  for (char& c : name) c = c == '_' ? '-' : c;
  return name;
}

std::vector<ChordMethod> chosen_methods(const std::string& name) {
  std::vector<std::string> names{"all"};
  for (const auto m : chord_methods()) names.push_back(hyphens(std::string(chord_method_name(m))));
  if (name == "all") return {chord_methods().begin(), chord_methods().end()};
  for (const auto m : chord_methods())
    if (names[0] != name && hyphens(std::string(chord_method_name(m))) == hyphens(name)) return {m};
  throw Error(ErrorKind::kUsage, "unknown method '" + name + "'" + suggestion(name, names),
              "--method");
}

// Difference of two longitudes in degrees, exact for near points, in (-180, 180].
double longitude_difference(double to, double from) {
  const double d = std::remainder(to - from, 360.0);
  return d == -180.0 ? 180.0 : d;
}

TableJob points_job(const Ellipsoid& ell, const std::vector<ChordMethod>& methods,
                    double benchmark_std, bool with_std) {
  TableJob job;
  job.partial = true;
  job.inputs = {"lat1_deg", "lon1_deg", "lat2_deg", "lon2_deg", "lat3_deg", "lon3_deg"};
  const bool one = methods.size() == 1;
  for (const auto m : methods) {
    const std::string tail = one ? "" : "_" + std::string(chord_method_name(m));
    job.outputs.push_back("k" + tail);
    job.outputs.push_back("eps" + tail + "_deg");
  }
  if (with_std) job.outputs.insert(job.outputs.end(), {"k_std", "eps_std_deg"});
  job.row = [=, names = job.inputs](std::span<const double> in, std::span<double> out) {
    for (std::size_t i = 0; i < 6; i += 2) {
      for (const auto& bad :
           {bad_latitude(names[i].c_str(), in[i]), bad_longitude(names[i + 1].c_str(), in[i + 1])})
        if (!bad.empty()) return bad;
    }
    const TwoPointInput points{in[0] * deg, 0.0,
                               in[2] * deg, longitude_difference(in[3], in[1]) * deg,
                               in[4] * deg, longitude_difference(in[5], in[1]) * deg};
    TwoPointOptions options;
    options.benchmark_std = benchmark_std;
    std::string why;
    for (std::size_t i = 0; i < methods.size(); ++i) {
      const auto r = calibrate_two_point(ell, methods[i], points, options);
      out[2 * i] = r.value.k;
      out[2 * i + 1] = r.value.eps / deg;
      if (!r.valid && why.empty()) why = std::string(chord_method_name(methods[i])) + ": " + r.why;
      // With all methods side by side the std is that of the rhumb chord; they agree to 1e-4 of it.
      if (with_std && r.valid && (one || methods[i] == ChordMethod::kRhumb)) {
        out[out.size() - 2] = r.value.k * r.ln_k_std;
        out[out.size() - 1] = r.eps_std / deg;
      }
    }
    return why;
  };
  return job;
}

}  // namespace

void add_calibrate_points(CLI::App& calibrate, Globals& globals) {
  auto o = std::make_shared<Options>();
  auto* sub = add_subcommand(
      calibrate, globals, "points",
      "two-point calibration on a CSV table: start, surveyed end, reckoned end",
      "printf 'lat1_deg,lon1_deg,lat2_deg,lon2_deg,lat3_deg,lon3_deg\\n"
      "55,110,55.5,111,55.6,111.3\\n' | loxo calibrate points --method all",
      [o, &globals]() -> int {
        const auto methods = chosen_methods(o->method);
        Ellipsoid ell;
        try {
          ell = ellipsoid_by_name(o->ellipsoid);
        } catch (const Error& e) {
          throw Error(ErrorKind::kUsage, e.what(), "--ellipsoid");
        }
        double std = 0.0;
        if (!o->std.empty()) std = option_quantity(o->std, Dimension::kLength, "--std");
        if (!(std >= 0.0) || !std::isfinite(std))
          throw Error(ErrorKind::kUsage, "expected a length of 0 or more, as 0.1m", "--std");
        return run_table(globals, "calibrate points", o->file,
                         [=, with_std = !o->std.empty()](const TableHeader&) {
                           return points_job(ell, methods, std, with_std);
                         });
      });
  sub->add_option("FILE", o->file, "CSV table; '-' or none: standard input");
  sub->add_option("--method", o->method,
                  "start-latitude, mean-latitude, rhumb, geodesic, gauss, or all side by side");
  sub->add_option("--ellipsoid", o->ellipsoid, "WGS84, GRS80, CGCS2000, Krassovsky, or a=…m,f=…");
  sub->add_option("--std", o->std,
                  "1 sigma of the benchmarks per axis, as 0.1m: adds k_std, eps_std_deg");
}

}  // namespace loxo::cli
