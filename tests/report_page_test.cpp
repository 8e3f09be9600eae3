// SPDX-License-Identifier: Apache-2.0
// A page with every kind of block, in hard cases, drawn by a real browser. LOXO_KEEP=FILE keeps the
// page for looking at it.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "loxo/report/page_html.hpp"

namespace loxo::report {
namespace {

constexpr double kDeg = std::numbers::pi / 180;

double noise(int i) {
  return std::sin(12.9898 * i) * 43758.5453 - std::floor(std::sin(12.9898 * i) * 43758.5453) - 0.5;
}

Map circle_map(const std::string& title, double lat0, double lon0, double radius, int n = 400,
               bool cross = false) {
  Map map;
  map.title = title;
  map.caption = "A loop" + std::string(cross ? " and a straight line through it" : "") +
                ", truth and reckoned.";
  for (int which = 0; which < 2; ++which) {
    Track t;
    t.name = which ? "reckoned" : "truth";
    for (int i = 0; i <= n; ++i) {
      const double a = 2 * std::numbers::pi * i / n,
                   r = radius / 6371000 * (1 + (which ? 0.04 * a / 6 : 0));
      const double e = cross ? 0.02 * r * which : r * std::sin(a),
                   nn = cross ? r * (1 - 2.0 * i / n) : r * std::cos(a);
      const double s0 = std::sin(lat0 * kDeg), c0 = std::cos(lat0 * kDeg);
      const double rho = std::hypot(e, nn), k = rho > 0 ? std::sin(rho) / rho : 1,
                   up = std::cos(rho);
      const double x = k * e, y = k * nn;
      t.lat.push_back(std::atan2(up * s0 + y * c0, std::hypot(up * c0 - y * s0, x)));
      t.lon.push_back(
          std::remainder(lon0 * kDeg + std::atan2(x, up * c0 - y * s0), 2 * std::numbers::pi));
      t.t.push_back(i * 3600.0 / n);
    }
    t.style = which ? Style::kDashed : Style::kLine;
    map.tracks.push_back(t);
  }
  map.points.push_back({"start", map.tracks[0].lat[0], map.tracks[0].lon[0], kNoValue, kNoValue, 0,
                        PointKind::kStart});
  map.points.push_back(
      {"B", map.tracks[0].lat[120], map.tracks[0].lon[120], 0.05 * radius, 0.03 * radius, 0.6});
  return map;
}

Page gallery() {
  Page page;
  page.title = "Every kind of block";
  page.subtitle = "A page made by a test, to be looked at";
  page.provenance = {{"program", "loxo"}, {"input", "none"}};
  std::vector<double> t, a, b, lo, hi;
  for (int i = 0; i <= 3600; ++i) {
    t.push_back(i);
    a.push_back(3 * std::sin(i / 500.0) + 0.2 * noise(i));
    b.push_back(i > 1200 && i < 1500 ? kNoValue : 3 * std::sin(i / 500.0 + 0.2));
    lo.push_back(b.back() - 0.001 * i);
    hi.push_back(b.back() + 0.001 * i);
  }
  Section words{"Words and tables", {}, ""};
  words.blocks.emplace_back(Text{"A paragraph with `code` and **strong** words.\n\n- one\n- two"});
  words.blocks.emplace_back(
      Text{"The scale agrees with the certificate: 0.3 sigma.", Verdict::kGood});
  words.blocks.emplace_back(
      Text{"Heading drift is not observable from this route.", Verdict::kNote});
  words.blocks.emplace_back(Text{"The solution left its 99.9 % band at 2:31.", Verdict::kBad});
  Table table;
  table.title = "Methods side by side";
  table.caption = "Scale and mounting angle of each method, one sigma.";
  table.columns = {{"method", ""}, {"k", "1"}, {"eps", "deg"}, {"closure", "m"}, {"verdict", ""}};
  table.rows = {
      {{"replay", Cell(1.20014, 0.00021), Cell(1.0021, 0.0023), Cell(0.03),
        Cell("valid", Verdict::kGood)},
       true,
       "recommended: uses the whole log, no route bias"},
      {{"rhumb", Cell(1.2009, 0.0011), Cell(1.11, 0.02), Cell(12.5), Cell("valid", Verdict::kGood)},
       false,
       ""},
      {{"start latitude", Cell(kNoValue), Cell(kNoValue), Cell(kNoValue),
        Cell("not valid", Verdict::kBad)},
       false,
       "the chord is zero"}};
  words.blocks.emplace_back(table);
  words.blocks.emplace_back(KeyValues{"Drive", {{"name", "south yard"}, {"length", "12.4 km"}}});
  words.blocks.emplace_back(
      Certificate{"Calibration of south yard",
                  "valid",
                  Verdict::kGood,
                  {{"scale k", 1.20014, 0.00021, ""},
                   {"mounting angle eps", 1.0021, 0.0023, "deg"},
                   {"heading drift", -0.013, 0.002, "deg/h"}},
                  {{1, 0.12, -0.4}, {0.12, 1, 0.03}, {-0.4, 0.03, 1}},
                  {{"vehicle", "truck 7"}, {"input hash", "`9f86d081884c7d65`"}}});
  Intervals intervals{
      "Scale by method",
      "Thick one sigma, thin two.",
      {"k", "1"},
      {{"replay", 1.20014, 0.00021, true}, {"rhumb", 1.2009, 0.0011}, {"start latitude", kNoValue}},
      1.2,
      "truth"};
  words.blocks.emplace_back(intervals);

  Section lines{"Lines", {}, ""};
  Series s;
  s.title = "East";
  s.caption = "East position of truth and solution with its two-sigma band; the gap is an outage.";
  s.x = {"time", "s"};
  s.y = {"east", "m"};
  s.at = t;
  s.curves = {{"truth", a}, {"solution", b, {}, lo, hi}};
  s.spans = {{1200, 1500, "no GNSS"}, {1500, 2200, "segment 2"}};
  s.marks = {{2600, "frame switch"}, {2.5, "limit", true}};
  s.sync = "time";
  lines.blocks.emplace_back(s);
  s.title = "Another, walking along";
  s.curves[0].style = Style::kPoints;
  lines.blocks.emplace_back(s);
  Series logs;
  logs.title = "Allan deviation";
  logs.half = true;
  logs.x = {"averaging time", "s", true};
  logs.y = {"deviation", "deg/h", true};
  std::vector<double> taus, dev;
  for (double tau = 0.01; tau < 1e4; tau *= 1.5)
    taus.push_back(tau), dev.push_back(std::hypot(0.5 / std::sqrt(tau), 0.02) + 1e-5 * tau);
  dev[3] = 0;
  logs.at = taus;
  logs.curves = {{"x", dev, {}, {}, {}, Style::kLinePoints},
                 {"fit", dev, {}, {}, {}, Style::kDashed}};
  lines.blocks.emplace_back(logs);
  Series tiny = logs;
  tiny.title = "Tiny numbers";
  tiny.x = {"leg length", "km"};
  tiny.y = {"error of k", "1"};
  tiny.curves = {{"mean latitude", {1e-9, 2e-9, 1.5e-9}},
                 {"one point", {2e-9}, {1.0}},
                 {"nothing", {kNoValue, kNoValue, kNoValue}}};
  tiny.at = {1, 2, 3};
  lines.blocks.emplace_back(tiny);
  lines.blocks.emplace_back(Series{"Empty", "", {}, {}, {}, {}, {}, {}, "", true});
  Fan fan{"Drift of 1000 trials",
          "Percentiles over time.",
          {"time", "s"},
          {"horizontal error", "m"},
          {},
          {},
          {}};
  for (int i = 0; i <= 100; ++i) fan.at.push_back(36 * i);
  for (const double p : {5, 25, 50, 75, 95}) {
    Percentile q{p, {}};
    for (int i = 0; i <= 100; ++i) q.y.push_back(p / 50 * 0.02 * i * i / 10);
    fan.percentiles.push_back(q);
  }
  fan.curves.push_back({"trial 4711", fan.percentiles.back().y});
  lines.blocks.emplace_back(fan);
  StackedArea stack{"Error budget", "Variance of position by source.",
                    {"time", "s"},  {"variance", "m²"},
                    fan.at,         {}};
  for (const char* name : {"gyro bias", "scale", "alignment", "noise"}) {
    Layer l{name, {}};
    for (int i = 0; i <= 100; ++i)
      l.y.push_back(std::pow(i / 40.0, 1.0 + static_cast<double>(stack.layers.size())));
    stack.layers.push_back(l);
  }
  lines.blocks.emplace_back(stack);

  Section many{"Distributions and planes", {}, ""};
  Sample one{"filter", {}}, two{"segmented", {}};
  Cloud cloud{"trials", {}, {}};
  for (int i = 0; i < 3000; ++i) {
    const double g = noise(i) + noise(i + 10000) + noise(i + 20000),
                 h = noise(i + 30000) + noise(i + 40000);
    one.values.push_back(0.1 + 0.02 * g);
    two.values.push_back(0.14 + 0.03 * h);
    cloud.x.push_back(g);
    cloud.y.push_back(0.5 * g + 0.4 * h);
  }
  many.blocks.emplace_back(Histogram{"Error",
                                     "Share of trials.",
                                     {"horizontal error", "% of distance"},
                                     {one, two},
                                     0,
                                     true,
                                     {{0.2, "gate"}}});
  many.blocks.emplace_back(
      Cdf{"Error, cumulative", "", {"horizontal error", "% of distance"}, {one, two}});
  many.blocks.emplace_back(
      Histogram{"One value", "", {"x", ""}, {{"a", {1, 1, 1}}, {"empty", {}}}});
  many.blocks.emplace_back(Cdf{"Nothing", "", {"x", ""}, {{"a", {}}}});
  many.blocks.emplace_back(Scatter{"End points",
                                   "Ninety-five per cent ellipse.",
                                   {"east", "m"},
                                   {"north", "m"},
                                   {cloud},
                                   {{"covariance", 0, 0, 0.25, 0.125, 0.089, 0.95}},
                                   {},
                                   true});
  Scatter curve{"Figure of eight",
                "A curve whose x goes back and forth.",
                {"x", "m"},
                {"y", "m"},
                {{"path", {}, {}, true}},
                {},
                {}};
  for (int i = 0; i <= 200; ++i)
    curve.clouds[0].x.push_back(std::sin(0.0628 * i)),
        curve.clouds[0].y.push_back(std::sin(0.0314 * i));
  many.blocks.emplace_back(curve);
  many.blocks.emplace_back(Roots{"Characteristic roots",
                                 "Schuler pair split by Foucault, and the Earth pair.",
                                 {{"Schuler", 0, 1.24e-3},
                                  {"Schuler", 0, -1.24e-3},
                                  {"Earth", 0, 7.29e-5},
                                  {"Earth", 0, -7.29e-5},
                                  {"", 0, 0}}});

  Section maps{"Maps", {}, ""};
  maps.blocks.emplace_back(circle_map("Loop of 5 km", 55, 110, 5000));
  maps.blocks.emplace_back(circle_map("Ten metres", -33, 151, 5));
  maps.blocks.emplace_back(circle_map("Over the North Pole", 90, 30, 900e3, 400, true));
  maps.blocks.emplace_back(circle_map("Round the North Pole, 1 km", 90, 0, 1000));
  maps.blocks.emplace_back(circle_map("Near the South Pole", -82, 60, 700e3));
  maps.blocks.emplace_back(circle_map("Across 180 degrees", 10, 180, 400e3));
  maps.blocks.emplace_back(circle_map("Half the world", 20, 20, 9000e3));
  Map point{"A single point", "", {{"truth", {0.8}, {0.2}, {}}}, {}};
  maps.blocks.emplace_back(point);
  maps.blocks.emplace_back(Map{"Nothing to show", "", {}, {}});
  page.sections = {words, lines, many, maps};
  return page;
}

std::string output_of(const std::string& command) {
  std::string out;
  FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) return out;
  char buffer[4096];
  std::size_t n = 0;
  while ((n = fread(buffer, 1, sizeof buffer, pipe)) > 0) out.append(buffer, n);
  pclose(pipe);
  return out;
}

// The page with `script` at its end, in a browser: its <html> tag, and what the console said.
class ReportPage : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"chromium", "chromium-browser", "google-chrome"})
      if (browser_.empty() &&
          std::system((std::string("command -v ") + name + " >/dev/null 2>&1").c_str()) == 0)
        browser_ = name;
    folder_ = std::filesystem::temp_directory_path() /
              ("loxo_page_" + std::to_string(getpid()) +
               testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  void draw(const Page& page, const std::string& script) {
    const auto file = folder_ / "page.html";
    std::string html = to_html(page);
    if (const char* keep = std::getenv("LOXO_KEEP")) std::ofstream(keep) << html;
    if (browser_.empty())
      GTEST_SKIP() << "no chromium on PATH: install it to have the page drawn by a browser";
    html.insert(html.rfind("</body>"), "<script>" + script + "</script>");
    std::ofstream(file) << html;
    const std::string dom =
        output_of("timeout 100 " + browser_ +
                  " --headless --no-sandbox --disable-gpu --no-first-run "
                  "--disable-background-networking --user-data-dir=" +
                  (folder_ / "profile").string() +
                  " --enable-logging=stderr --virtual-time-budget=3000 --dump-dom file://" +
                  file.string() + " 2>" + (folder_ / "log").string());
    const auto at = dom.find("<html");
    root_ = at == std::string::npos ? dom.substr(0, 400) : dom.substr(at, dom.find('>', at) - at);
    std::stringstream log;
    log << std::ifstream(folder_ / "log").rdbuf();
    for (std::string line; std::getline(log, line);)
      if (line.find(":CONSOLE") != std::string::npos) console_ += line + "\n";
  }
  std::string browser_, root_, console_;
  std::filesystem::path folder_;
};

TEST_F(ReportPage, EveryBlockIsDrawnByABrowser) {
  const Page page = gallery();
  draw(page, "");
  if (IsSkipped()) return;
  std::size_t blocks = 0;
  for (const auto& s : page.sections) blocks += s.blocks.size();
  EXPECT_NE(root_.find("data-blocks=\"" + std::to_string(blocks) + "\""), std::string::npos)
      << root_;
  EXPECT_NE(root_.find("data-rendered=\"" + std::to_string(blocks) + "\""), std::string::npos)
      << root_;
  EXPECT_NE(root_.find("data-errors=\"0\""), std::string::npos) << root_;
  EXPECT_EQ(console_, "");
}

// Every button pressed, every chart and map moved by keyboard and pointer: nothing breaks, legends
// really switch, charts of one clock zoom together, and what was hidden is shown again.
TEST_F(ReportPage, EveryControlCanBeUsed) {
  draw(gallery(), R"(
    const seen = [];
    setTimeout(() => {
      for (const p of document.querySelectorAll('.plot')) {
        for (const key of ['+', 'ArrowRight', 'ArrowLeft', '-']) p.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true, cancelable: true }));
        for (const over of p.querySelectorAll('.u-over, canvas'))
          for (const type of ['mouseenter', 'mousemove', 'pointermove', 'pointerleave', 'mouseleave'])
            over.dispatchEvent(new MouseEvent(type, { clientX: over.getBoundingClientRect().left + 90, clientY: over.getBoundingClientRect().top + 40, bubbles: true }));
      }
      const zoomed = document.querySelectorAll('.plot.chart')[0];
      zoomed.dispatchEvent(new KeyboardEvent('keydown', { key: '+' }));
      setTimeout(() => {
        // The first two charts share a clock: both offer the way back.
        const resets = [...document.querySelectorAll('.reset')].slice(0, 2).map((b) => !b.hidden);
        document.documentElement.dataset.together = String(resets[0] && resets[1]);
        const key = document.querySelector('.key');
        key.click();
        document.documentElement.dataset.off = key.getAttribute('aria-pressed');
        key.click();
        for (const b of document.querySelectorAll('button')) b.click();
        dispatchEvent(new Event('beforeprint'));
        dispatchEvent(new Event('afterprint'));
      }, 200);
    }, 200);
  )");
  if (IsSkipped()) return;
  EXPECT_NE(root_.find("data-together=\"true\""), std::string::npos) << root_;
  EXPECT_NE(root_.find("data-off=\"false\""), std::string::npos) << root_;
  EXPECT_NE(root_.find("data-errors=\"0\""), std::string::npos) << root_;
  EXPECT_EQ(console_, "");
}

}  // namespace
}  // namespace loxo::report
