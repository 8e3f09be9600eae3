// SPDX-License-Identifier: Apache-2.0
// `loxo transfer test DRIVE`: this unit in the polar region, on one page.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/transfer.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/report/page_html.hpp"
#include "loxo/study/polar_trial.hpp"
#include "loxo/study/transfer_drive.hpp"

namespace loxo::cli {
namespace {

// Share of the starts that must lie within three sigma: a recorded reference has its worse seconds
// (between tall buildings, say).
constexpr double kMost = 0.9;

struct Summary {
  double length = 0;
  std::size_t starts = 0;
  Quantiles home, pole, difference, conversion, mechanization, physics, left;    // m
  Quantiles home_heading, pole_heading, heading_difference, heading_conversion;  // rad
  // Share of the starts whose rest lies within three times what the conversion predicts.
  double within = kNone;
  std::vector<double> homes, poles, differences;
};

Summary summary_of(const PolarTrialWindow& w) {
  Summary out;
  out.length = w.length;
  out.starts = w.starts.size();
  std::vector<double> conversion, mechanization, turned, left, hh, ph, hd, hc;
  std::size_t inside = 0;
  for (const auto& s : w.starts) {
    out.homes.push_back(std::hypot(s.home[0], s.home[1]));
    out.poles.push_back(std::hypot(s.pole[0], s.pole[1]));
    out.differences.push_back(std::hypot(s.pole[0] - s.home[0], s.pole[1] - s.home[1]));
    conversion.push_back(s.conversion);
    mechanization.push_back(s.mechanization);
    hh.push_back(std::fabs(s.home_heading)), ph.push_back(std::fabs(s.pole_heading));
    hd.push_back(std::fabs(s.pole_heading - s.home_heading));
    hc.push_back(s.conversion_heading);
    turned.push_back(std::hypot(s.physics[0], s.physics[1]));
    left.push_back(
        std::hypot(s.pole[0] - s.home[0] - s.physics[0], s.pole[1] - s.home[1] - s.physics[1]));
    const double allowed = 3 * s.conversion + s.mechanization;
    inside += left.back() <= allowed ? 1 : 0;
  }
  out.home = quantiles(out.homes), out.pole = quantiles(out.poles);
  out.difference = quantiles(out.differences), out.conversion = quantiles(conversion);
  out.mechanization = quantiles(mechanization), out.physics = quantiles(turned),
  out.left = quantiles(left);
  out.home_heading = quantiles(hh), out.pole_heading = quantiles(ph);
  out.heading_difference = quantiles(hd), out.heading_conversion = quantiles(hc);
  if (out.starts > 0) out.within = static_cast<double>(inside) / static_cast<double>(out.starts);
  return out;
}

Json quantiles_json(const Quantiles& q, double unit = 1) {
  return {{"p50", q.p50 / unit}, {"p95", q.p95 / unit}, {"max", q.max / unit}};
}

report::Page page_of(const Drive& drive, const PolarTrialResult& r,
                     const std::vector<Summary>& windows, const std::string& verdict,
                     const std::string& alignment, const TransferOptions& o, bool good) {
  using namespace report;
  Page page;
  page.title = "This unit in the polar region";
  page.subtitle =
      fmt::format("{}: moved by {} about the meridian {}", drive.name, o.angle, o.meridian);
  page.provenance = {{"program", LOXO_VERSION}, {"drive", drive.path}};
  Section found{.title = "What was found"};
  found.blocks.push_back(
      report::Text{verdict, good ? report::Verdict::kGood : report::Verdict::kNote});
  Table table{.title = "Free-inertial drift from many starts",
              .caption =
                  "Horizontal error at the end of a window, height held to the reference, at home "
                  "and at the pole. Physics: the other Earth rate and gravity acting on the same "
                  "errors. The rest should not exceed three times the conversion: 1 sigma of what "
                  "the reference's errors put into the moved data. Mechanization: the largest "
                  "distance between transverse, grid, wander and ECEF."};
  table.columns = {{"window", "s"},           {"starts", ""},
                   {"home 50 %", "m"},        {"home 95 %", "m"},
                   {"pole 50 %", "m"},        {"pole 95 %", "m"},
                   {"difference 95 %", "m"},  {"physics 95 %", "m"},
                   {"rest 95 %", "m"},        {"conversion 50 %", "m"},
                   {"mechanization max", "m"}};
  const auto short_number = [](double x) { return Cell(fmt::format("{:.4g}", x)); };
  for (const Summary& s : windows) {
    Row row;
    for (const double x :
         {s.length, static_cast<double>(s.starts), s.home.p50, s.home.p95, s.pole.p50, s.pole.p95,
          s.difference.p95, s.physics.p95, s.left.p95, s.conversion.p50, s.mechanization.max})
      row.cells.push_back(short_number(x));
    table.rows.push_back(std::move(row));
  }
  found.blocks.push_back(std::move(table));
  found.blocks.push_back(Text{alignment});
  page.sections.push_back(std::move(found));

  Section places{.title = "Both voyages"};
  places.blocks.push_back(
      Map{.title = "On the Earth",
          .caption = "The voyage at home and where the move brings it.",
          .tracks = {Track{.name = "at the pole", .lat = r.pole_lat, .lon = r.pole_lon, .t = r.t},
                     Track{.name = "at home", .lat = r.home_lat, .lon = r.home_lon, .t = r.t}}});
  places.blocks.push_back(Map{
      .title = "At the pole",
      .caption = "The moved voyage; the same shape, turned with its frame.",
      .tracks = {Track{.name = "at the pole", .lat = r.pole_lat, .lon = r.pole_lon, .t = r.t}}});
  places.blocks.push_back(
      Map{.title = "At home",
          .tracks = {Track{.name = "at home", .lat = r.home_lat, .lon = r.home_lon, .t = r.t}}});
  page.sections.push_back(std::move(places));

  Section drift{.title = "Drift"};
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const Summary& s = windows[i];
    if (s.starts == 0) continue;
    drift.blocks.push_back(
        Cdf{.title = fmt::format("{} s", s.length),
            .caption = "Horizontal error at the end of the window: share of the starts below it.",
            .x = Axis{.label = "horizontal error", .unit = "m"},
            .samples = {Sample{"at home", s.homes}, Sample{"at the pole", s.poles},
                        Sample{"difference", s.differences}}});
    Scatter cloud{.title = fmt::format("{} s, each start", s.length),
                  .caption =
                      "Error at the window's end in the transverse axes, which the move "
                      "keeps: the same unit from the same start at both places.",
                  .x = Axis{.label = "east", .unit = "m"},
                  .y = Axis{.label = "north", .unit = "m"}};
    Cloud home{.name = "at home"}, pole{.name = "at the pole"};
    for (const auto& start : r.windows[i].starts) {
      home.x.push_back(start.home[0]), home.y.push_back(start.home[1]);
      pole.x.push_back(start.pole[0]), pole.y.push_back(start.pole[1]);
    }
    cloud.clouds = {std::move(home), std::move(pole)};
    cloud.equal = true;
    drift.blocks.push_back(std::move(cloud));
  }
  page.sections.push_back(std::move(drift));
  return page;
}

}  // namespace

int transfer_trial(const Globals& globals, const TransferOptions& o) {
  if (o.drive.empty()) throw Error(ErrorKind::kUsage, "expected a drive");
  PolarTrialSettings settings;
  settings.sigma = reference_sigma(o);
  if (!o.windows.empty()) {
    settings.windows.clear();
    for (const auto& w : o.windows) {
      settings.windows.push_back(option_quantity(w, Dimension::kTime, "--windows"));
      if (!(settings.windows.back() > 0))
        throw Error(ErrorKind::kUsage, "expected times above 0, found '" + w + "'", "--windows");
    }
  }
  const Drive drive = read_drive(o.drive, globals.sets);
  settings.move = polar_move(drive, o);
  Diagnostics diagnostics = drive.diagnostics;
  PolarTrialResult r;
  {
    Progress progress(globals, "transfer test", 1.0);
    r = telling(globals, diagnostics, [&] {
      return polar_trial(drive, settings, diagnostics, [&](double x) { progress.at(x); });
    });
  }
  std::vector<Summary> windows;
  for (const auto& w : r.windows) windows.push_back(summary_of(w));

  std::string text = fmt::format(
      "{} moved by {} about the meridian {}: {} samples, {:.4g} s\n"
      "free-inertial drift from many starts, height held [m]: 50 % 95 % max. Of the difference: "
      "physics (the other Earth rate and gravity, first order), the rest, beside what errors of "
      "the reference of {:.3g}' heading, {:.3g}' level, {:.3g} m/s put into the data (1 sigma), "
      "and "
      "what the polar mechanizations differ by\n"
      "{:>8} {:>6} {:>20} {:>20} {:>21} {:>14} {:>15} {:>10} {:>8}\n",
      drive.name, o.angle, o.meridian, r.samples, r.end_t - r.begin_t,
      settings.sigma.heading / arcmin, settings.sigma.level / arcmin, settings.sigma.velocity,
      "window", "starts", "at home", "at the pole", "difference", "physics 50 95", "rest 50 95",
      "conversion", "frames");
  Json rows = Json::array();
  bool all_within = true;
  double worst = 1;
  for (const Summary& s : windows) {
    if (s.starts == 0) continue;
    const auto three = [](const Quantiles& q) {
      return fmt::format("{:.3g} {:.3g} {:.3g}", q.p50, q.p95, q.max);
    };
    const auto two = [](const Quantiles& q) { return fmt::format("{:.3g} {:.3g}", q.p50, q.p95); };
    text += fmt::format("{:>6.4g} s {:>6} {:>20} {:>20} {:>21} {:>14} {:>15} {:>10.3g} {:>8.2g}\n",
                        s.length, s.starts, three(s.home), three(s.pole), three(s.difference),
                        two(s.physics), two(s.left), s.conversion.p50, s.mechanization.max);
    worst = std::min(worst, s.within);
    all_within = all_within && s.within >= kMost;
    rows.push_back({{"window_s", s.length},
                    {"starts", s.starts},
                    {"home_m", quantiles_json(s.home)},
                    {"pole_m", quantiles_json(s.pole)},
                    {"difference_m", quantiles_json(s.difference)},
                    {"conversion_std_m", quantiles_json(s.conversion)},
                    {"mechanization_m", quantiles_json(s.mechanization)},
                    {"physics_m", quantiles_json(s.physics)},
                    {"unexplained_m", quantiles_json(s.left)},
                    {"home_heading_deg", quantiles_json(s.home_heading, deg)},
                    {"pole_heading_deg", quantiles_json(s.pole_heading, deg)},
                    {"heading_difference_deg", quantiles_json(s.heading_difference, deg)},
                    {"heading_conversion_std_deg", quantiles_json(s.heading_conversion, deg)},
                    {"within_budget", s.within}});
  }
  const std::string verdict = fmt::format(
      "The conversion {} the unit: once the physics is taken out, the difference between pole and "
      "home lies within three sigma of the conversion error in {:.0f} % of the starts{}.",
      all_within ? "does not disturb" : "disturbs", 100 * worst,
      all_within ? ""
                 : "; the reference is worse than said (--heading-error, --level-error, "
                   "--velocity-error), or it does not belong to this log");
  // Self-alignment: east gyro bias over the horizontal Earth rate.
  std::string alignment =
      "Alignment at the pole: gravity levels the unit as at home; its heading cannot be found from "
      "the Earth's rate there and must be carried in.";
  if (std::isfinite(drive.imu_errors.gyro_bias)) {
    const auto sigma = [&](double lat) {
      const double c = std::cos(lat) * drive.ellipsoid.w_ie;
      return c > 0 ? drive.imu_errors.gyro_bias / c : kNone;
    };
    const double home = sigma(r.home_lat.front()), pole = sigma(r.pole_lat.front());
    const auto said = [](double x) {
      return x < 0.5 ? fmt::format("{:.3g} deg", x / deg) : std::string("not at all");
    };
    alignment = fmt::format(
        "Alignment: by its own gyros (bias {:.3g} deg/h, 1 sigma) this unit finds its heading to "
        "{} "
        "at home and {} at the moved start (latitude {:.3f} deg): a physical difference, which the "
        "drift above, started from the reference, does not hold.",
        drive.imu_errors.gyro_bias / deg_per_h, said(home), said(pole), r.pole_lat.front() / deg);
  }
  print_diagnostics(globals, diagnostics);
  say(globals, text + verdict + "\n" + alignment);
  if (!globals.output.empty()) {
    report::write_page(page_of(drive, r, windows, verdict, alignment, o, all_within),
                       globals.output);
    say(globals, globals.output);
  }
  if (globals.json)
    print_json({{"command", "transfer test"},
                {"samples", r.samples},
                {"windows", rows},
                {"within_budget", worst},
                {"conversion_as_predicted", all_within},
                {"alignment", alignment},
                {"output", globals.output.empty() ? Json(nullptr) : Json(globals.output)},
                {"diagnostics", to_json(diagnostics)}});
  return 0;
}

}  // namespace loxo::cli
