// SPDX-License-Identifier: Apache-2.0
// `loxo transfer DRIVE -o DRIVE2`: the drive at the pole, with its own sensor errors.
#include <fmt/format.h>

#include <cmath>

#include "cli/transfer.hpp"
#include "loxo/log/convert.hpp"
#include "loxo/log/drive_folder.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/transfer_drive.hpp"

namespace loxo::cli {

PolarMove polar_move(const Drive& drive, const TransferOptions& o) {
  if (o.angle.empty() || o.meridian.empty())
    throw Error(ErrorKind::kUsage, "expected --angle and --meridian, with their units");
  if (o.earth != "ellipsoid" && o.earth != "sphere")
    throw Error(ErrorKind::kUsage, "expected ellipsoid or sphere, found '" + o.earth + "'",
                "--earth");
  if (!o.keep.empty() && o.keep != "path" && o.keep != "velocity")
    throw Error(ErrorKind::kUsage, "expected path or velocity, found '" + o.keep + "'", "--keep");
  if (o.earth == "sphere" && drive.ellipsoid.f > 0)
    throw Error(ErrorKind::kUsage,
                "the drive is on " + drive.ellipsoid.name +
                    "; the sphere's formulas keep path and velocity both, which is wrong there by "
                    "0.7 % of the speed and 4.6e-4 m/s^2 "
                    "in turns; use --earth ellipsoid with --keep path or velocity",
                "--earth");
  PolarMove move{drive.ellipsoid, option_quantity(o.meridian, Dimension::kAngle, "--meridian"),
                 option_quantity(o.angle, Dimension::kAngle, "--angle"),
                 o.keep == "velocity" ? Keep::kVelocity : Keep::kPath};
  if (std::fabs(move.angle) > 2 * kPi)
    throw Error(ErrorKind::kUsage, "expected an angle within -360 to 360 deg", "--angle");
  if (std::fabs(move.lon0) > 2 * kPi)
    throw Error(ErrorKind::kUsage, "expected a meridian within -360 to 360 deg", "--meridian");
  return move;
}

int transfer_drive(const Globals& globals, const TransferOptions& o) {
  if (o.drive.empty())
    throw Error(ErrorKind::kUsage,
                "expected a drive or an operation (budget, plan, rates); see 'loxo transfer "
                "--help'");
  if (globals.output.empty())
    throw Error(ErrorKind::kUsage,
                "expected -o DRIVE2, the folder of the moved drive (or a .h5 file)");
  const Drive drive = read_drive(o.drive, globals.sets);
  const bool one_file = globals.output.ends_with(".h5");
  const TransferSettings settings{polar_move(drive, o), one_file || o.binary, o.trim, o.angle,
                                  o.meridian};
  Diagnostics diagnostics = drive.diagnostics;
  // One .h5 file is put together from a folder that is gone afterwards.
  DriveFolder folder(globals.output + (one_file ? ".parts" : ""));
  const TransferResult r = telling(globals, diagnostics, [&] {
    return loxo::transfer_drive(drive, settings, folder.path(), diagnostics);
  });
  if (one_file)
    convert_drive(read_drive(folder.path()), globals.output, diagnostics);
  else
    folder.commit();
  const char* keep = settings.move.keep == Keep::kPath ? "path" : "velocity";
  print_diagnostics(globals, diagnostics);
  std::string text =
      r.samples > 0
          ? fmt::format(
                "{}: {} samples moved, {} kept; correction at most {:.4g} m/s^2, {:.4g} "
                "deg/h\n"
                "reference every {:.3g} s closes on the IMU to {:.3g}\" and {:.3g} m/s "
                "rms an interval",
                globals.output, r.samples, keep, r.largest_df, r.largest_dw / deg_per_h,
                r.closure.interval_mean, r.closure.attitude_rms / arcsec, r.closure.velocity_rms)
          : fmt::format("{}: {} epochs of the reference moved, {} kept; the drive has no [imu]",
                        globals.output, r.reference_epochs, keep);
  say(globals, text);
  if (globals.json)
    print_json({{"command", "transfer"},
                {"output", globals.output},
                {"samples", r.samples},
                {"reference_epochs", r.reference_epochs},
                {"left_out", r.left_out},
                {"keep", keep},
                {"df_max_mps2", r.largest_df},
                {"dw_max_radps", r.largest_dw},
                {"reference_interval_s", r.closure.interval_mean},
                {"closure_attitude_rad", r.closure.attitude_rms},
                {"closure_velocity_mps", r.closure.velocity_rms},
                {"diagnostics", to_json(diagnostics)}});
  return 0;
}

}  // namespace loxo::cli
