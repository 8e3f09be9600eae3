// SPDX-License-Identifier: Apache-2.0
#include "loxo/calibrate/calibration.hpp"

namespace loxo {

std::string_view state_name(State s) {
  switch (s) {
    case State::kScale:
      return "scale";
    case State::kAngle:
      return "angle";
    case State::kDrift:
      return "heading_drift";
    case State::kPitch:
      return "pitch_mounting";
    case State::kLeverRight:
      return "lever_arm_right";
    case State::kLeverForward:
      return "lever_arm_forward";
    case State::kStartNorth:
      return "start_offset_north";
    case State::kStartEast:
      return "start_offset_east";
  }
  return "?";
}

std::string_view state_words(State s) {
  switch (s) {
    case State::kScale:
      return "scale";
    case State::kAngle:
      return "mounting angle";
    case State::kDrift:
      return "heading drift";
    case State::kPitch:
      return "pitch mounting";
    case State::kLeverRight:
      return "lever arm to the right";
    case State::kLeverForward:
      return "lever arm forward";
    case State::kStartNorth:
      return "start offset north";
    case State::kStartEast:
      return "start offset east";
  }
  return "?";
}

}  // namespace loxo
