// SPDX-License-Identifier: Apache-2.0
// `loxo navigate`: the options of all modes; one file per family of modes.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "cli/command.hpp"
#include "loxo/earth/frames.hpp"

namespace loxo {
struct AlignmentReport;  // study/filter_drive.hpp
struct Drive;            // log/drive.hpp
}  // namespace loxo

namespace loxo::cli {

struct NavigateOptions {
  std::string drive;
  std::string mode = "reckon";       // inertial | reckon | segmented | filter | smooth
  std::string frame = "auto";        // geographic | transverse | grid | wander | ecef | auto
  std::string calibration;           // --calibration CERT
  std::string integrator = "exact";  // exact | midpoint | start-latitude
  std::string meridian = "0deg";     // reference meridian of the transverse frame
  std::string vertical;  // free | fixed | ship | external; "" = external where the drive has
                         // heights, else the mode's default
  std::string output_rate = "10Hz";  // text; the binary form is at full rate
  int precision = 0;
  bool force = false;  // continue with a poor alignment, with its honest sigma
  // filter, smooth, segmented
  std::string use, without;            // witnesses, comma-separated
  std::string fixes_until, fix_every;  // times, as 946s
  bool no_fixes = false;
  std::string innovations;           // file of every innovation, for `evaluate`
  std::vector<std::string> outages;  // START:LENGTH, as 650s:340s
};

// How the start was aligned and how well it can be known; keys of --json, and lines of text.
Json to_json(const AlignmentReport& report);
std::string alignment_text(const AlignmentReport& report);

// What the modes share. The frame asked for; `automatic` with the geographic one to begin with.
struct FrameOption {
  bool automatic = false;
  FrameId frame = FrameId::kGeographic;
};
FrameOption frame_option(const NavigateOptions& options);
// Seconds between rows; 0, every step, for the binary form. Throws Error(kUsage).
double output_period(const NavigateOptions& options, const std::string& output);
bool is_binary(const std::string& output);
// The head of a solution: mode, ellipsoid, version, drive, hash of the IMU's file.
std::map<std::string, std::string> solution_meta(const NavigateOptions& options,
                                                 const Drive& drive);

int navigate_reckon(const Globals& globals, const NavigateOptions& options);  // navigate_reckon.cpp
int navigate_inertial(const Globals& globals,
                      const NavigateOptions& options);  // navigate_inertial.cpp
int navigate_filter(
    const Globals& globals,
    const NavigateOptions& options);  // navigate_filter.cpp: segmented, filter, smooth

}  // namespace loxo::cli
