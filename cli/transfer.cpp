// SPDX-License-Identifier: Apache-2.0
// `loxo transfer`: a recorded drive moved to the pole with its own sensor errors.
#include "cli/transfer.hpp"

#include <memory>

#include "loxo/num/error.hpp"

namespace loxo::cli {

void add_transfer(CLI::App& app, Globals& globals) {
  auto o = std::make_shared<TransferOptions>();
  CLI::App* transfer = add_command(
      app, globals, "transfer", "a recorded drive moved to the pole with its own sensor errors",
      "loxo transfer rates --help", [o, &globals] { return transfer_drive(globals, *o); });
  transfer->add_option("DRIVE", o->drive, "the recorded drive: [imu] and [reference]");
  transfer->add_option(
      "--angle", o->angle,
      "of the transfer, with its unit; positive toward the north pole along the meridian");
  transfer->add_option("--meridian", o->meridian,
                       "reference meridian, near the track, with its unit");
  transfer->add_option("--earth", o->earth, "ellipsoid, or sphere where the drive is on one");
  transfer->add_option("--keep", o->keep,
                       "path (default) or velocity: an ellipsoid does not let both stay");
  transfer->add_flag("--binary", o->binary,
                     "IMU and reference as .h5 files in the folder (-o NAME.h5: all in one file)");
  transfer->add_flag("--trim", o->trim, "leave out what the reference does not cover");
  CLI::App* rates = add_subcommand(
      *transfer, globals, "rates", "the conversion of single states, and its error, on a CSV table",
      "printf "
      "'tlat_deg,tlon_deg,angle_deg,vte_mps,vtn_mps,theading_deg,pitch_deg,roll_deg,g_mps2,gm_"
      "mps2\\n"
      "0,59,59,5,0,90,0,0,9.795,9.832\\n' | loxo transfer rates --earth sphere",
      [o, &globals] { return transfer_rates(globals, *o); });
  rates->add_option("FILE", o->table, "CSV table; '-' or none: standard input");
  rates->add_option("--earth", o->earth, "ellipsoid, or sphere (R 6371000 m)");
  rates->add_option(
      "--keep", o->keep,
      "velocity (formula (3)), or path (needs the recorded force fx_mps2, fy_mps2, fz_mps2)");
  rates->add_option("--ellipsoid", o->ellipsoid, "WGS84, GRS80, CGCS2000, Krassovsky, or a=…m,f=…");
  const auto reference_and_unit = [&](CLI::App* op) {
    op->add_option("--heading-error", o->heading_error, "1 sigma of the reference's heading");
    op->add_option("--level-error", o->level_error, "1 sigma of the reference's pitch and roll");
    op->add_option("--velocity-error", o->velocity_error,
                   "1 sigma of the reference's east and north velocity");
    op->add_option("--gyro-bias", o->gyro_bias, "1 sigma of the unit's gyro bias");
    op->add_option("--accel-bias", o->accel_bias, "1 sigma of the unit's accelerometer bias");
    op->add_option("--share", o->share, "of the unit's own errors that the conversion may add");
  };
  CLI::App* budget = add_subcommand(
      *transfer, globals, "budget",
      "what the reference's errors put into the converted data of this drive, beside its unit's "
      "own",
      "loxo transfer budget DRIVE --angle 58.96deg --meridian 122.9deg --heading-error 3arcmin",
      [o, &globals] { return transfer_budget(globals, *o); });
  budget->add_option("DRIVE", o->drive, "the recorded drive: its [reference] and [imu] errors");
  budget->add_option("--angle", o->angle, "of the transfer, with its unit");
  budget->add_option("--meridian", o->meridian, "reference meridian, with its unit");
  budget->add_option("--draws", o->draws, "of the Monte Carlo beside the formula");
  reference_and_unit(budget);
  CLI::App* trial = add_subcommand(
      *transfer, globals, "test",
      "this unit in the polar region: free-inertial drift at home and at the pole, and why they "
      "differ; -o PAGE.html for the page",
      "loxo transfer test DRIVE --angle 58.96deg --meridian 122.9deg -o polar.html",
      [o, &globals] { return transfer_trial(globals, *o); }, Output::kPage);
  trial->add_option("DRIVE", o->drive, "the recorded drive: [imu] and [reference]");
  trial->add_option("--angle", o->angle, "of the transfer, with its unit");
  trial->add_option("--meridian", o->meridian, "reference meridian, with its unit");
  trial->add_option("--keep", o->keep, "path (default) or velocity");
  trial->add_option("--windows", o->windows, "lengths of the windows, as 60s,300s (default)")
      ->delimiter(',');
  reference_and_unit(trial);
  CLI::App* plan = add_subcommand(
      *transfer, globals, "plan",
      "from which latitude, with which reference, is the conversion error small beside the unit's "
      "own",
      "loxo transfer plan --gyro-bias 0.01deg/h --accel-bias 10ug --heading-error 3arcmin",
      [o, &globals] { return transfer_plan(globals, *o); });
  reference_and_unit(plan);
  plan->add_option("--latitude", o->latitude,
                   "one home latitude, with its unit; default: a table from 0 to 80 deg");
  plan->add_option("--angle", o->angle, "the angle of the transfer; default: to the pole");
  plan->add_option("--ellipsoid", o->ellipsoid, "WGS84, GRS80, CGCS2000, Krassovsky, or a=…m,f=…");
}

}  // namespace loxo::cli
