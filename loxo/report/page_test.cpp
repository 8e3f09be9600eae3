// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <regex>

#include "loxo/report/coast.hpp"
#include "loxo/report/page_html.hpp"
#include "loxo/report/thin.hpp"

namespace loxo::report {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

TEST(Thin, KeepsTheOnePeakInAMillion) {
  std::vector<double> y(1'000'000, 0.0);
  y[123456] = 7;
  y[654321] = -3;
  y[500000] = std::nan("");
  const auto kept = thin_curve(y, 1000);
  EXPECT_LE(kept.size(), 1010u);
  EXPECT_EQ(kept.front(), 0u);
  EXPECT_EQ(kept.back(), y.size() - 1);
  for (const std::size_t i : {123456u, 654321u, 500000u})
    EXPECT_TRUE(std::find(kept.begin(), kept.end(), i) != kept.end()) << i;
  EXPECT_TRUE(std::is_sorted(kept.begin(), kept.end()));
}

TEST(Thin, ShortCurvesStayWhole) {
  const std::vector<double> y{1, 2, std::nan(""), 4};
  EXPECT_EQ(thin_curve(y, 100).size(), 4u);
  EXPECT_TRUE(thin_curve(std::vector<double>{}, 100).empty());
}

// A square of 1 km across the pole, across 180 degrees and anywhere: its corners survive any
// thinning.
TEST(Thin, CornersOfATrackSurviveEverywhere) {
  for (const double lat0 : {0.0, 48.0, 89.999, -89.9999})
    for (const double lon0 : {0.0, 179.9999, -100.0}) {
      const double r = 6371000, side = 1000;
      std::vector<double> lat, lon;
      std::vector<std::size_t> corners;
      const double s0 = std::sin(lat0 * kDegree), c0 = std::cos(lat0 * kDegree);
      for (int edge = 0; edge < 4; ++edge)
        for (int i = 0; i < 5000; ++i) {
          const double a = i / 5000.0 * side;
          const double e = edge == 0 ? a : edge == 1 ? side : edge == 2 ? side - a : 0;
          const double n = edge == 0 ? 0 : edge == 1 ? a : edge == 2 ? side : side - a;
          // A point of the tangent plane put on the sphere.
          const double x = e / r, y = n / r;
          const double up = c0 - y * s0, north = s0 + y * c0;
          lat.push_back(std::atan2(north, std::hypot(up, x)));
          lon.push_back(std::remainder(lon0 * kDegree + std::atan2(x, up), 2 * std::numbers::pi));
          if (i == 0 && edge > 0) corners.push_back(lat.size() - 1);
        }
      const auto kept = thin_track(lat, lon, 40);
      EXPECT_LE(kept.size(), 45u);
      // Candidates stand at a stride of 25 (20000 / (20 * 40)), so a corner may be missed by one
      // stride.
      for (const auto c : corners) {
        std::size_t best = lat.size();
        for (const auto k : kept) best = std::min(best, k > c ? k - c : c - k);
        EXPECT_LE(best, 25u) << "lat " << lat0 << " lon " << lon0;
      }
    }
}

TEST(Thin, TrackKeepsItsGaps) {
  std::vector<double> lat(10000), lon(10000);
  for (std::size_t i = 0; i < lat.size(); ++i)
    lat[i] = 1e-6 * std::sin(1e-3 * static_cast<double>(i)), lon[i] = 1e-6 * static_cast<double>(i);
  for (std::size_t i = 4000; i < 5000; ++i) lat[i] = std::nan("");
  const auto kept = thin_track(lat, lon, 100);
  int gaps = 0;
  for (const auto i : kept) gaps += std::isnan(lat[i]);
  EXPECT_EQ(gaps, 1);
  EXPECT_LE(kept.size(), 110u);
}

TEST(Thin, StandingStillIsOnePlace) {
  const std::vector<double> lat(200000, 0.7), lon(200000, 0.1);
  EXPECT_LE(thin_track(lat, lon, 1000).size(), 10u);
}

TEST(Bins, CountEveryFiniteValueOnce) {
  std::vector<double> v;
  for (int i = 0; i < 1000; ++i) v.push_back(std::sin(i * 1.7));
  v.push_back(std::nan(""));
  v.push_back(INFINITY);
  const auto bins = make_bins({v, {0.5, 0.5}}, 0);
  double n = 0;
  for (const double c : bins.counts[0]) n += c;
  EXPECT_EQ(n, 1000);
  EXPECT_EQ(bins.edges.size(), bins.counts[0].size() + 1);
  EXPECT_EQ(make_bins({{3, 3, 3}}, 0).counts[0].size(), 20u);
  EXPECT_TRUE(make_bins({{}, {std::nan("")}}, 0).edges.empty());
}

TEST(Percentile, BetweenOrderStatistics) {
  const std::vector<double> v{1, 2, 3, 4, 5};
  EXPECT_EQ(percentile(v, 50), 3);
  EXPECT_EQ(percentile(v, 0), 1);
  EXPECT_EQ(percentile(v, 100), 5);
  EXPECT_EQ(percentile(v, 62.5), 3.5);
  EXPECT_TRUE(std::isnan(percentile(std::vector<double>{}, 50)));
}

TEST(FormatNumber, TwoDigitsOfTheError) {
  EXPECT_EQ(format_number(1.23456789, 0.000123), "1.23457 ± 0.00012");
  EXPECT_EQ(format_number(1.2, 0.0996), "1.20 ± 0.10");
  EXPECT_EQ(format_number(-3.0, 12), "−3 ± 12");
  EXPECT_EQ(format_number(12345.6, 230), "12346 ± 230");
  EXPECT_EQ(format_number(3.1e-7, 2e-9), "(3.100 ± 0.020)·10⁻⁷");
  EXPECT_EQ(format_number(-1.25e-7), "−1.25·10⁻⁷");
  EXPECT_EQ(format_number(1.5e12), "1.5·10¹²");
  EXPECT_EQ(format_number(1.5, 0), "1.5 (exact)");
  EXPECT_EQ(format_number(0.1 + 0.2), "0.3");
  EXPECT_EQ(format_number(-0.0), "0");
  EXPECT_EQ(format_number(std::nan("")), "–");
}

// Svalbard from a track west of it: fine there, coarse elsewhere, and a ring goes back to where it
// began.
TEST(Coast, FineAboutTheTrackOnly) {
  std::vector<double> lat, lon;
  for (int i = 0; i < 100; ++i)
    lat.push_back((77 + 0.03 * i) * kDegree), lon.push_back(8 * kDegree);
  const auto land = coast_about(lat, lon);
  ASSERT_FALSE(land.empty());
  std::size_t near = 0, far = 0;
  std::vector<std::vector<int>> rings;
  for (const auto& polygon : land) rings.insert(rings.end(), polygon.begin(), polygon.end());
  for (const auto& ring : rings) {
    int x = 0, y = 0, first[2] = {0, 0};
    for (std::size_t i = 0; i + 1 < ring.size(); i += 2) {
      x += ring[i];
      y += ring[i + 1];
      if (i == 0) first[0] = x, first[1] = y;
      ASSERT_LE(std::abs(x), 18000);
      ASSERT_LE(std::abs(y), 9000);
      (x > 1000 && x < 2000 && y > 7700 && y < 8000 ? near : far)++;
    }
    EXPECT_EQ(x, first[0]);
    EXPECT_EQ(y, first[1]);
  }
  EXPECT_GT(near, 60u);
  EXPECT_LT(far, 6000u);
}

TEST(Coast, NoneForAYardOrTheWholeEarth) {
  EXPECT_TRUE(coast_about(std::vector<double>{0.8, 0.8001}, std::vector<double>{0.1, 0.1}).empty());
  EXPECT_TRUE(coast_about(std::vector<double>{-1.2, 1.2, 0}, std::vector<double>{0, 1, 2}).empty());
  EXPECT_TRUE(coast_about(std::vector<double>{}, std::vector<double>{}).empty());
}

Page small_page() {
  Page page{"A </script><b>title", "sub & title", {{"program", "loxo 0.1.0"}}, {}};
  Section section{"One", {}, ""};
  section.blocks.emplace_back(Text{"Some `code`.", Verdict::kGood});
  section.blocks.emplace_back(Table{"T",
                                    "",
                                    {{"method", ""}, {"k", "1"}},
                                    {{{"replay", Cell(1.0015, 2e-5)}, true, "recommended"}}});
  Series s;
  s.title = "S";
  s.x = {"time", "s"};
  s.y = {"east", "m"};
  s.at = {0, 1, 2};
  s.curves.push_back({"truth", {0.5, kNoValue, 1.0 / 3}});
  section.blocks.emplace_back(s);
  section.blocks.emplace_back(
      Map{"M", "", {{"drive", {90 * kDegree}, {std::numbers::pi}, {}}}, {}});
  page.sections.push_back(section);
  return page;
}

TEST(PageJson, Golden) {
  EXPECT_EQ(
      to_json(small_page()),
      R"({"title":"A \u003c/script\u003e\u003cb\u003etitle","subtitle":"sub \u0026 title","provenance":[["program","loxo 0.1.0"]],)"
      R"("sections":[{"title":"One","blocks":[{"kind":"text","text":"Some `code`.","verdict":"good"},)"
      R"({"kind":"table","title":"T","columns":[{"title":"method"},{"title":"k","unit":"1"}],"rows":[{"highlighted":true,"note":"recommended",)"
      R"("cells":["replay",{"text":"1.001500 ± 0.000020","value":1.0015}]}]},)"
      R"({"kind":"series","title":"S","x":{"label":"time","unit":"s"},"y":{"label":"east","unit":"m"},"curves":[{"name":"truth",)"
      R"("x":[0,1,2],"y":[0.5,null,0.333333333]}]},)"
      R"({"kind":"map","title":"M","tracks":[{"name":"drive","lat":[90],"lon":[180]}],"points":[]}]}]})");
}

TEST(PageJson, BytesThatAreNotUtf8AreReplaced) {
  Page page{"\xff\xc3\xa9\xe2\x82", "", {}, {}};
  EXPECT_NE(to_json(page).find("\"title\":\"\xEF\xBF\xBD\xc3\xa9\xEF\xBF\xBD\xEF\xBF\xBD\""),
            std::string::npos)
      << to_json(page);
}

TEST(PageHtml, OneFileWithoutNetwork) {
  const std::string html = to_html(small_page());
  EXPECT_LT(html.size(), 400'000u);
  EXPECT_FALSE(std::regex_search(html, std::regex("https?:/"))) << "an address in the page";
  for (const char* word :
       {"src=", "@import", "url(", "XMLHttpRequest", "WebSocket", "sendBeacon", "<link"})
    EXPECT_EQ(html.find(word), std::string::npos) << word;
  EXPECT_EQ(html.find("</script><b>"), std::string::npos);
  EXPECT_EQ(html.find("<title>A &lt;/script&gt;&lt;b&gt;title</title>") == std::string::npos,
            false);
  EXPECT_EQ(to_html(small_page()), html);
}

TEST(PageHtml, BelowTwoMegabytesWhateverTheLog) {
  Page page{"big", "", {}, {}};
  Section section{"s", {}, ""};
  std::vector<double> t(300'000), y(300'000);
  for (std::size_t i = 0; i < t.size(); ++i)
    t[i] = 0.01 * static_cast<double>(i), y[i] = std::sin(0.37 * static_cast<double>(i * i % 1000));
  for (int k = 0; k < 60; ++k) {
    Series s;
    s.at = t;
    s.curves = {{"a", y}, {"b", y}};
    section.blocks.emplace_back(s);
  }
  Table table;
  table.columns = {{"n", ""}};
  for (int i = 0; i < 50'000; ++i)
    table.rows.push_back({{Cell(static_cast<double>(i))}, false, ""});
  section.blocks.emplace_back(table);
  page.sections.push_back(section);
  const auto html = to_html(page);
  EXPECT_LT(html.size(), kMaxBytes);
  EXPECT_GT(html.size(), 500'000u);
}

}  // namespace
}  // namespace loxo::report
