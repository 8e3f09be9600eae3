// SPDX-License-Identifier: Apache-2.0
// Stated confidence is true: normalised errors of simulated drives are chi-square, for every error
// source, through the real calibration. LOXO_LONG=1: 2,000 drives each, as the goal says.
#include "loxo/study/calibration_trials.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "loxo/num/units.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

int drives(int fast, int full) { return std::getenv("LOXO_LONG") != nullptr ? full : fast; }

class StatedConfidence : public ::testing::TestWithParam<CalibrationTrials> {};

// (V-43), V-44, V-45: mean of e^T P^-1 e inside the band that it leaves once in 10,000 seeds.
TEST_P(StatedConfidence, IsTrue) {
  const auto r =
      run_calibration_trials(wgs84(), GetParam(), drives(400, 2000), testing::seed(20260731));
  for (const auto& s : r.states)
    std::printf("%-20s stated %.4g found %.4g mean %.4g ratio %.3f\n",
                std::string(state_name(s.state)).c_str(), s.stated, s.found, s.mean, s.ratio);
  std::printf("nees %.4f in [%.4f, %.4f], dimension %d\n", r.nees, r.low, r.high, r.dimension);
  EXPECT_EQ(r.valid, r.drives);
  EXPECT_GT(r.dimension, 0);
  EXPECT_GE(r.nees, r.low);
  EXPECT_LE(r.nees, r.high);
}
INSTANTIATE_TEST_SUITE_P(Sources, StatedConfidence, ::testing::ValuesIn(stated_confidence_trials()),
                         [](const auto& one) {
                           std::string name = one.param.name;
                           for (char& c : name)
                             if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
                           return name;
                         });

}  // namespace
}  // namespace loxo
