// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/online_calibration.hpp"

#include <fmt/format.h>

#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/filter_drive.hpp"

namespace loxo {

OnlineCalibration online_calibration(const Drive& drive, Diagnostics& diagnostics) {
  OnlineCalibration out;
  if (!drive.imu.present || !drive.odometer.present) {
    out.why = "needs [imu] and [odometer]";
    return out;
  }
  FilterResult r;
  try {
    r = filter_drive(
        drive, FilterOptions{}, [](const SolutionRow&) {}, diagnostics);
  } catch (const Error& e) {
    if (e.kind() != ErrorKind::kWork) throw;
    out.why = e.what();
    return out;
  }
  out.k = r.k, out.k_std = r.k_std;
  out.eps = r.eps_h, out.eps_std = r.eps_h_std;
  out.correlation = r.k_eps_correlation;
  for (const Estimated& e : r.constants) {
    if (e.name == "pitch_mounting_deg")
      out.pitch_mounting = e.value * deg, out.pitch_mounting_std = e.std * deg;
    if (e.name == "delay_s") out.delay = e.value, out.delay_std = e.std;
  }
  if (r.diverged) {
    out.why = fmt::format("the filter diverged at t = {:.1f} s", r.diverged_t);
  } else if (!(out.k_std < 0.02)) {
    out.why =
        fmt::format("the drive does not show the scale: its sigma is still {:.2g}", out.k_std);
  } else if (!(out.eps_std < 1.5 * deg)) {
    out.why =
        fmt::format("the drive does not show the mounting angle: its sigma is still {:.2g} deg",
                    out.eps_std / deg);
  } else {
    out.valid = true;
  }
  return out;
}

}  // namespace loxo
