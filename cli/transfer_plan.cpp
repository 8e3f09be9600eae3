// SPDX-License-Identifier: Apache-2.0
// `loxo transfer plan`: from which home latitude, with which angle and which reference, does the
// conversion disturb a unit by less than a share of its own errors?
#include <fmt/format.h>

#include <cmath>

#include "cli/transfer.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/sim/transfer_budget.hpp"

namespace loxo::cli {
namespace {

Json or_null(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }
std::string or_any(double x, double unit, const char* format) {
  return std::isfinite(x) ? fmt::format(fmt::runtime(format), x / unit) : std::string("any");
}

}  // namespace

int transfer_plan(const Globals& globals, const TransferOptions& o) {
  const ReferenceSigma sigma = reference_sigma(o);
  const UnitSigma unit{option_quantity(o.gyro_bias.empty() ? "0.01deg/h" : o.gyro_bias,
                                       Dimension::kAngularRate, "--gyro-bias"),
                       option_quantity(o.accel_bias.empty() ? "10ug" : o.accel_bias,
                                       Dimension::kAcceleration, "--accel-bias")};
  if (!(unit.gyro_bias > 0) || !(unit.accel_bias > 0))
    throw Error(ErrorKind::kUsage, "the unit's biases must be above 0",
                "--gyro-bias, --accel-bias");
  const double share = option_quantity(o.share, Dimension::kNone, "--share");
  if (!(share > 0)) throw Error(ErrorKind::kUsage, "expected a share above 0", "--share");
  Ellipsoid earth;
  try {
    earth = ellipsoid_by_name(o.ellipsoid);
  } catch (const Error& e) {
    throw Error(ErrorKind::kUsage, e.what(), "--ellipsoid");
  }
  std::vector<double> latitudes;
  if (o.latitude.empty())
    for (int d = 0; d <= 80; d += 10) latitudes.push_back(d * deg);
  else
    latitudes.push_back(option_quantity(o.latitude, Dimension::kAngle, "--latitude"));

  Json rows = Json::array();
  std::string text = fmt::format(
      "conversion error, 1 sigma of one axis, for a level ship or vehicle on any heading; the "
      "middle of the track comes to the pole\n"
      "reference: heading {:.3g}', level {:.3g}', velocity {:.3g} m/s; unit: {:.3g} deg/h, {:.3g} "
      "ug; good: at most {:.3g} of the unit's own\n"
      "{:>8} {:>8} {:>8} {:>8} {:>10} {:>10} {:>10} {:>7} {:>7}   reference needed: heading, "
      "level, velocity\n",
      sigma.heading / arcmin, sigma.level / arcmin, sigma.velocity, unit.gyro_bias / deg_per_h,
      unit.accel_bias / ug, share, "lat", "angle", "A", "B", "accel ug", "gyro d/h", "up d/h",
      "gyro", "accel");
  bool any_good = false;
  for (const double latitude : latitudes) {
    if (std::fabs(latitude) > 90 * deg)
      throw Error(ErrorKind::kUsage, "expected a latitude within -90 to 90 deg", "--latitude");
    const double angle = o.angle.empty() ? 90 * deg - latitude
                                         : option_quantity(o.angle, Dimension::kAngle, "--angle");
    const PlanRow r = plan_row(earth, latitude, angle, sigma, unit, share);
    any_good = any_good || r.verdict.good;
    text += fmt::format(
        "{:8.2f} {:8.2f} {:8.4f} {:8.4f} {:10.4g} {:10.4g} {:10.4g} {:7.3g} {:7.3g} {} {}', {}', "
        "{} m/s\n",
        latitude / deg, angle / deg, r.A, r.B, r.accel / ug, r.gyro / deg_per_h,
        r.gyro_up / deg_per_h, r.verdict.gyro_ratio, r.verdict.accel_ratio,
        r.verdict.good ? " good" : "   no", or_any(r.needed.heading, arcmin, "{:.3g}"),
        or_any(r.needed.level, arcmin, "{:.3g}"), or_any(r.needed.velocity, 1.0, "{:.3g}"));
    rows.push_back({{"latitude_deg", latitude / deg},
                    {"angle_deg", angle / deg},
                    {"a", r.A},
                    {"b", r.B},
                    {"gravity_difference_mps2", r.G},
                    {"accel_error_mps2", r.accel},
                    {"gyro_error_radps", r.gyro},
                    {"gyro_up_error_radps", r.gyro_up},
                    {"accel_ratio", r.verdict.accel_ratio},
                    {"gyro_ratio", r.verdict.gyro_ratio},
                    {"good", r.verdict.good},
                    {"needed_heading_deg", or_null(r.needed.heading / deg)},
                    {"needed_level_deg", or_null(r.needed.level / deg)},
                    {"needed_velocity_mps", or_null(r.needed.velocity)}});
  }
  text +=
      "meridian: the longitude of the track's middle (a track p degrees beside it adds sin p of A "
      "to the error)";
  say(globals, text);
  if (globals.json)
    print_json(
        {{"command", "transfer plan"}, {"share", share}, {"rows", rows}, {"any_good", any_good}});
  return 0;
}

}  // namespace loxo::cli
