// SPDX-License-Identifier: Apache-2.0
// What a reader says about the order of stamps.
#include "loxo/log/channel.hpp"

#include <gtest/gtest.h>

namespace loxo {
namespace {

class Stamps : public ::testing::Test {
 protected:
  // Feeds stamps as a file would; returns how many went forward.
  std::size_t feed(const std::vector<double>& t) {
    StampCheck check("imu");
    MemoryTable table("x.csv", {}, {"t_s"}, {t});
    table.select({"t_s"});
    double row[1];
    std::size_t forward = 0;
    while (table.next(row, d_))
      forward += check.check(
                     row[0], [&] { return table.where(); }, d_) == StampCheck::Verdict::kForward;
    usual_ = check.usual_step();
    return forward;
  }
  std::string place(std::string_view kind) const {
    for (const auto& d : d_.list())
      if (d.kind == kind) return d.where;
    return "";
  }
  static std::vector<double> regular(std::size_t n, double step = 0.01) {
    std::vector<double> t;
    for (std::size_t i = 0; i < n; ++i) t.push_back(step * static_cast<double>(i));
    return t;
  }
  Diagnostics d_;
  double usual_ = 0;
};

TEST_F(Stamps, ARegularLogSaysNothing) {
  EXPECT_EQ(feed(regular(500)), 500u);
  EXPECT_TRUE(d_.empty());
  EXPECT_NEAR(usual_, 0.01, 1e-12);
}
TEST_F(Stamps, OneMissingSampleAnywhere) {
  // Also before the usual step is known, and twice in a row.
  for (const std::size_t lost : {1u, 3u, 8u, 9u, 100u, 498u}) {
    SCOPED_TRACE(lost);
    d_ = {};
    auto t = regular(500);
    t.erase(t.begin() + static_cast<std::ptrdiff_t>(lost));
    feed(t);
    EXPECT_EQ(d_.count("gap"), 1u);
    EXPECT_EQ(place("gap"), "x.csv: row " + std::to_string(lost + 1));
  }
}
TEST_F(Stamps, AChangeOfRateIsLearned) {
  auto t = regular(100);
  for (int i = 1; i <= 400; ++i) t.push_back(0.99 + 0.05 * i);
  feed(t);
  // Until the median has turned over: at most one window of 32.
  EXPECT_GE(d_.count("gap"), 1u);
  EXPECT_LE(d_.count("gap"), 32u);
  EXPECT_NEAR(usual_, 0.05, 1e-12);
}
TEST_F(Stamps, BunchedStampsAreNoGaps) {
  std::vector<double> t;
  t.reserve(300);
  for (int i = 0; i < 300; ++i) t.push_back(0.02 * i + (i % 3 == 0 ? 0.012 : 0.0));
  feed(t);
  EXPECT_EQ(d_.count("gap"), 0u);
}
TEST_F(Stamps, AnHourIsAGapOnce) {
  auto t = regular(100);
  for (int i = 1; i <= 100; ++i) t.push_back(3600 + 0.01 * i);
  feed(t);
  EXPECT_EQ(d_.count("gap"), 1u);
}
TEST_F(Stamps, DuplicatesAndReversals) {
  EXPECT_EQ(feed({0, 1, 1, 2, 1.5, 3}), 4u);
  EXPECT_EQ(d_.count("duplicate"), 1u);
  EXPECT_EQ(d_.count("time_back"), 1u);
}

}  // namespace
}  // namespace loxo
