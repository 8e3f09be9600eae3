// SPDX-License-Identifier: Apache-2.0
#include "loxo/report/solution_sections.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace loxo::report {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

template <typename T>
std::vector<const T*> blocks_of(const Section& section) {
  std::vector<const T*> out;
  for (const auto& b : section.blocks)
    if (const T* p = std::get_if<T>(&b)) out.push_back(p);
  return out;
}
const Series* find(const Section& section, const std::string& title) {
  for (const auto* s : blocks_of<Series>(section))
    if (s->title == title) return s;
  return nullptr;
}

// On a sphere, which is all that the pictures need.
Solution along(double lat0, double lon0, double dlat, double dlon, int n) {
  Solution s;
  for (int i = 0; i < n; ++i) {
    SolutionRow r;
    r.t = 1000000 + i;
    r.lat = (lat0 + dlat * i) * kDegree;
    r.lon = std::remainder((lon0 + dlon * i) * kDegree, 2 * std::numbers::pi);
    r.x = 6371e3 * std::cos(r.lat) * std::cos(r.lon);
    r.y = 6371e3 * std::cos(r.lat) * std::sin(r.lon);
    r.z = 6371e3 * std::sin(r.lat);
    r.heading = std::fmod(350 + i, 360.0) * kDegree;
    s.rows.push_back(r);
  }
  return s;
}

TEST(MotionSection, SmallTracksInMetresFromTheStart) {
  const auto s = along(55, 110, 1e-4, 0, 50);
  const auto section = motion_section({{"drive", &s}});
  const auto* north = find(section, "North of the start");
  ASSERT_NE(north, nullptr);
  EXPECT_EQ(north->curves[0].y.front(), 0);
  // 49 steps of 1e-4 deg: 6371e3 sin(angle) in the plane that touches at the start.
  EXPECT_NEAR(north->curves[0].y.back(), 6371e3 * std::sin(49e-4 * kDegree), 1e-6);
  EXPECT_NEAR(find(section, "East of the start")->curves[0].y.back(), 0, 1e-6);
  EXPECT_EQ(find(section, "Latitude"), nullptr);
  EXPECT_EQ(north->curves[0].x.front(), 0)
      << "times since the beginning: " << time_origin({{"drive", &s}});
}

TEST(MotionSection, LargeTracksInDegreesBrokenWhereTheAngleJumps) {
  const auto s = along(0, 175, 0, 0.5, 40);
  const auto section = motion_section({{"drive", &s}});
  const auto* lon = find(section, "Longitude");
  ASSERT_NE(lon, nullptr);
  int gaps = 0;
  for (std::size_t i = 1; i < lon->curves[0].y.size(); ++i) {
    const double a = lon->curves[0].y[i - 1], b = lon->curves[0].y[i];
    gaps += std::isnan(b);
    EXPECT_FALSE(std::fabs(b - a) > 180) << i;
  }
  EXPECT_EQ(gaps, 1);
  const auto* heading = find(section, "Heading");
  ASSERT_NE(heading, nullptr);
  EXPECT_TRUE(std::isnan(heading->curves[0].y[10]));  // 359 -> 0
}

TEST(MotionSection, FramesAreShadedAndHealthIsTold) {
  auto s = along(78, 20, 0.1, 0, 60);
  for (std::size_t i = 20; i < 40; ++i) s.rows[i].frame = FrameId::kGrid;
  s.rows[20].health = kHealthSwitched;
  s.rows[40].health = kHealthSwitched | kHealthDiverged;
  const auto section = motion_section({{"drive", &s}});
  const auto& spans = find(section, "Latitude")->spans;
  ASSERT_EQ(spans.size(), 3u);
  EXPECT_EQ(spans[1].label, "grid");
  EXPECT_EQ(spans[1].from, 20);
  EXPECT_EQ(spans[1].to, 40);
  const auto tables = blocks_of<Table>(section);
  ASSERT_EQ(tables.size(), 1u);
  ASSERT_EQ(tables[0]->rows.size(), 2u);
  EXPECT_EQ(tables[0]->rows[0].cells[1].verdict, Verdict::kBad);  // diverged
  EXPECT_EQ(tables[0]->rows[1].cells[2].value, 2);                // two switches
}

TEST(MapSection, StartEndAndSurveyedPoints) {
  const auto s = along(55, 110, 1e-4, 0, 50);
  Solution empty;
  MapPoint b{"A", 0.9, 1.9};
  const auto section = map_section({{"nothing", &empty}, {"drive", &s, true}}, {b});
  const auto& map = *blocks_of<Map>(section).at(0);
  EXPECT_EQ(map.tracks.size(), 2u);
  ASSERT_EQ(map.points.size(), 3u);
  EXPECT_EQ(map.points[1].kind, PointKind::kStart);
  EXPECT_EQ(map.points[2].lat, s.rows.back().lat);
}

TEST(Sections, NothingGivenNothingShown) {
  EXPECT_TRUE(motion_section({}).blocks.empty());
  EXPECT_EQ(blocks_of<Map>(map_section({}, {})).size(), 1u);
}

}  // namespace
}  // namespace loxo::report
