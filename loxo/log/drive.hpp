// SPDX-License-Identifier: Apache-2.0
// A Log on disk: a folder with drive.toml and data files (or one .h5 file). The description is read
// whole; the samples are streamed by the readers below, converted to SI, body axes
// right-forward-up, at the door.
#pragma once
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "loxo/earth/ellipsoid.hpp"
#include "loxo/ins/samples.hpp"
#include "loxo/ins/solution.hpp"
#include "loxo/text/diagnostics.hpp"
#include "loxo/text/toml.hpp"

namespace loxo {

// One section of sensors: which file, which columns, in which units.
struct ChannelFile {
  bool present = false;
  std::string section;                                      // "imu", "odometer" …
  std::string file;                                         // absolute or relative to the drive
  std::map<std::string, std::vector<std::string>> columns;  // key of the section -> column names
  std::map<std::string, std::string> units;                 // key -> unit text, where given
  double delay = 0;     // s: the value at a stamp is what happened this much earlier
  double rate = kNone;  // Hz: rows without a time column, the first at t = 0
  std::string table;    // which table of a file that holds several (h5 group, mat variable)
  std::string named, named_table;  // file and table as drive.toml says them
  double origin_lat = kNone, origin_lon = kNone,
         origin_h = 0;  // rad, m: of east, north (up) columns
  std::string where;    // the section's place, for messages
};

// Declared 1-sigma errors of the sensors; kNone where not declared. SI. Shared names with
// errors/sensor_errors.
struct ImuErrors {
  double gyro_bias = kNone, gyro_noise = kNone, accel_bias = kNone,
         accel_noise = kNone;                            // rad/s, rad/sqrt(s), m/s^2, m/s/sqrt(s)
  double gyro_bias_tau = kNone, accel_bias_tau = kNone;  // s
  double gyro_scale = kNone, accel_scale = kNone;        // 1
  double gyro_misalignment = kNone;                      // rad, each of the six cross elements
};
struct OdometerErrors {
  double scale_noise = kNone;         // white, 1 sigma of each increment relative to it
  double noise = kNone;               // m, white, of each reading
  double distance_noise = kNone;      // m/sqrt(m), white over the way
  double quantisation = kNone;        // m
  double speed_quantisation = kNone;  // m/s, of kind speed
  double speed_noise = kNone;         // m/s, white, of each reading of kind speed
  double side_slip = kNone;           // rad, white, per increment
  double scale = kNone;               // 1 sigma of the constant, before calibration
};
struct AttitudeErrors {          // of [attitude] or of a [track]'s heading
  double heading_bias = kNone;   // rad, initial azimuth error s_psi0
  double heading_drift = kNone;  // rad/s, constant drift s_b
  double heading_noise = kNone;  // rad/sqrt(s), angle random walk N
};

struct NamedBenchmark {
  std::string name;
  Benchmark point;
};

struct StartSection {
  bool present = false;
  double t = kNone, lat = kNone, lon = kNone, h = kNone;  // rad, m
  bool from_benchmark = false;                            // the position is the first benchmark's
  std::optional<std::string> alignment_kind;  // "static", "swaying", "gyrocompass", "stored" …
  double alignment_duration = kNone;          // s
  double heading = kNone, pitch = kNone, roll = kNone;  // rad, attitude = { … }
  double heading_std = kNone;                           // rad, attitude = { heading_std = … }
  double level_std = kNone;                             // rad, of pitch and roll given there
  // errors = { position, velocity, level, heading }, 1 sigma of each axis: m, m/s, rad, rad; the
  // last two are level_std and heading_std.
  double position_std = kNone, velocity_std = kNone;
  double ve = kNone, vn = kNone, vu = kNone;  // m/s, velocity at the start
  bool has_state = false;                     // state = { … }: ECEF, means something at the pole
  double state_t = kNone, r[3]{}, v[3]{}, q[4]{1, 0, 0, 0};  // q body -> ECEF, scalar first
};

// drive.toml, read and checked. Throws Error(kInput) naming file:line and key for every fault.
struct Drive {
  std::string path;       // as given by the user
  std::string folder;     // where relative files are looked for; empty: a .h5 drive
  std::string toml;       // the text of drive.toml (for copying by transfer and convert)
  std::string toml_path;  // where it stands ("drive.h5:drive.toml" of a .h5 drive)
  std::string name;
  Ellipsoid ellipsoid;

  ChannelFile imu;
  std::string imu_kind = "rate";  // rate | increment
  std::string imu_stamp = "end";  // end | middle | instant
  std::string imu_axes = "RFU";
  ImuErrors imu_errors;
  double imu_gyro_bias[3]{}, imu_accel_bias[3]{};  // rad/s, m/s^2, RFU: known, taken out before use
  double imu_gyro_range = kNone, imu_accel_range = kNone;  // saturation, optional

  ChannelFile odometer;
  std::string odometer_kind = "pulses";  // pulses | counter | distance | speed
  double odometer_scale = 1.0;           // m/pulse, or 1 for distance and speed
  double odometer_wrap = kNone;          // counts at which a counter starts again at 0
  double odometer_lever[3]{};            // m, RFU
  bool odometer_lever_given = false;
  bool odometer_mounting_given = false;
  double odometer_mounting_heading = 0, odometer_mounting_pitch = 0;  // rad
  double wheel_base = kNone;   // m, where columns.steering is given
  double steering_offset = 0;  // rad, clockwise: what it shows straight ahead
  OdometerErrors odometer_errors;

  ChannelFile attitude;
  ChannelFile track;
  AttitudeErrors attitude_errors;
  HeadingModel heading_model = HeadingModel::kIndependent;
  bool heading_model_given = false;
  bool earth_rate = false;
  HeadingReference heading_reference = HeadingReference::kTrue;
  double track_scale = 1.0;            // k and eps already known, taken out before use
  double track_heading_offset = 0.0;   // rad
  bool track_heading_is_step = false;  // columns.heading_step: increments

  std::vector<NamedBenchmark> benchmarks;
  ChannelFile fix;
  double fix_lever[3]{};
  double fix_lever_std =
      kNone;  // m, errors = { lever_arm = "0.5 m" }: the antenna's place is sought
  double fix_std = kNone,
         fix_velocity_std =
             kNone;  // where no std columns: errors = { position = "3 m", velocity = "0.1 m/s" }
  ChannelFile velocity;
  std::string velocity_axes = "RFU";  // of columns.velocity
  double velocity_std = kNone;        // errors = { velocity = "0.02 m/s" }
  ChannelFile heading;
  double heading_std = kNone;
  ChannelFile height;
  double height_std = kNone, height_bias = kNone,
         height_bias_tau = kNone;  // m, errors = { height = "2 m", bias = "10 m" }
  StartSection start;
  ChannelFile reference;

  Diagnostics diagnostics;
};

// PATH: a folder with drive.toml, a .toml file, or a .h5 drive. `sets`: --set key=value, applied
// before checking.
Drive read_drive(const std::string& path, const std::vector<std::string>& sets = {});

// A folder, a .toml file, or a .h5 file that holds a drive.
bool is_drive(const std::string& path);

// "data:set/file.csv" and "$LOXO_DATA/set/file.csv" stand for $LOXO_DATA/set/file.csv or, without
// that variable, for the first data/ or shared/data/ folder that has it on the way up from
// `folder`; other paths are relative to `folder`.
std::string resolve_path(const std::string& file, const std::string& folder);
// C (row-major, signed permutation, determinant +1) with x_RFU = C x_axes, for "FRD", "FLU", "RBD"
// … (R L F B U D; E W N S for R L F B). Throws Error(kInput) for what is no right-handed triple.
std::array<double, 9> axes_to_rfu(const std::string& axes, const std::string& where);

// IMU samples in time order as increments over (previous stamp, this stamp], RFU, SI. Rates are
// turned into increments with the stamp's meaning. Bad rows, gaps, time going back, duplicates,
// saturation, wrong units or axes (norm of specific force, Earth rate) are told to the diagnostics.
// A gap of up to 3 intervals is bridged with the mean of its neighbours (dt is then the whole gap);
// after a longer one dt is one interval, so that t - dt lies after the last sample's t: the hole
// can be seen.
class ImuReader {
 public:
  ImuReader(const Drive& drive, Diagnostics& diagnostics);
  ~ImuReader();
  bool next(ImuIncrement<double>& sample);
  double interval() const;  // s, nominal: median of the first 1000 steps
  // The sample that next() gave last touched the sensor's limit.
  bool saturated() const;
  // What the first rows say against the declared units (no number computed from them means
  // anything) and axes; empty where they fit.
  const std::string& unit_fault() const;
  const std::string& axes_fault() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Whole channels in memory (they are small beside the IMU). Each applies `delay` to its stamps.
std::vector<OdometerTick> read_odometer(const Drive& drive, Diagnostics& diagnostics);
std::vector<AttitudeSample> read_attitude(const Drive& drive, Diagnostics& diagnostics);
// The track's rows; or, without [track], built from a distance ([odometer], else [velocity]) and a
// heading ([attitude], else [heading], else odometer.columns.steering, else the direction of a
// level velocity): one step between stamps, heading and pitch at mid-step. Scale, heading offset
// and mounting already known are taken out. Throws Error(kInput) naming what is missing.
std::vector<TrackStep> read_track(const Drive& drive, Diagnostics& diagnostics);
// What a drive lacks for read_track, in words; empty: nothing.
std::string track_lacks(const Drive& drive);
// Headings over time of [heading]: as recorded, of a gyro integrated, or the course of a path.
std::vector<AttitudeSample> read_heading_log(const Drive& drive, Diagnostics& diagnostics);
// Attitude of the body over time, where a sensor tells it ([attitude], or [heading] with headings);
// empty where there is only a track, a gyro, steering or a path.
std::vector<AttitudeSample> read_body_attitude(const Drive& drive, Diagnostics& diagnostics);
std::vector<Fix> read_fixes(const Drive& drive, Diagnostics& diagnostics);
std::vector<HeadingSample> read_headings(const Drive& drive, Diagnostics& diagnostics);
std::vector<HeightSample> read_heights(const Drive& drive, Diagnostics& diagnostics);
std::vector<VelocitySample> read_velocities(const Drive& drive, Diagnostics& diagnostics);
// [reference] with its columns and origin. Throws Error(kInput) where the drive has none.
Solution read_reference(const Drive& drive, Diagnostics& diagnostics);

}  // namespace loxo
