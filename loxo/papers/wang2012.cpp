// SPDX-License-Identifier: Apache-2.0
// Wang et al. 2012: the segmented method, of which only a fragment is known. Its two claims, held
// against simulated hours on three routes (the ready campaigns acceptance-straight …).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <memory>

#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/papers/reproduce.hpp"
#include "loxo/study/campaign.hpp"
#include "loxo/study/campaign_pool.hpp"

namespace loxo::papers {
namespace {

constexpr Claim kClaims[] = {
#include "loxo/papers/wang2012.inc"
};

double quantile(std::vector<double> v, double q) {
  if (v.empty()) return kNotPrinted;
  std::sort(v.begin(), v.end());
  const double i = q * static_cast<double>(v.size() - 1);
  const auto k = static_cast<std::size_t>(i);
  return k + 1 < v.size() ? v[k] + (i - static_cast<double>(k)) * (v[k + 1] - v[k]) : v[k];
}

// The trials of one route, by the ready campaign acceptance-ROUTE without its filter of 31 states.
class Route {
 public:
  Route(const std::string& name, const Options& o, std::size_t runs, std::uint64_t seed)
      : name_(name), rows_(runs) {
    CampaignSource source;
    source.name = "acceptance-" + name;
    for (const auto& ready : ready_campaigns())
      if (ready.name == source.name) source.text = ready.text;
    source.seed = seed;
    source.sets = {"settings.mode=[\"segmented\"]",
                   fmt::format("parameters.gyro_bias=\"{} deg/h\"", 0.01 * o.model.gyro_drift),
                   fmt::format("parameters.mounting_preset=\"{} deg\"", o.model.angle_sign)};
    if (o.brief) source.sets.emplace_back("settings.duration=\"600 s\"");
    campaign_ = read_campaign(source, "reproduce");
  }
  // Eight runs in lanes where there are eight.
  std::size_t pieces() const { return rows_.size() / 8 + rows_.size() % 8; }
  void run(std::size_t piece) {
    const std::size_t whole = rows_.size() / 8;
    if (piece >= whole) {
      const std::size_t k = 8 * whole + (piece - whole);
      rows_[k] = run_trial(campaign_, k);
      return;
    }
    Campaign& c = campaign_;
    const std::size_t width = c.identity.columns.size() + 1;
    const Block b = run_block(c, piece, 8);
    for (std::size_t k = 0; k < 8; ++k)
      rows_[8 * piece + k].assign(b.rows.begin() + static_cast<std::ptrdiff_t>(k * width),
                                  b.rows.begin() + static_cast<std::ptrdiff_t>((k + 1) * width));
  }
  std::vector<double> column(const std::string& name) const {
    const auto& columns = campaign_.identity.columns;
    for (std::size_t j = 0; j < columns.size(); ++j)
      if (columns[j].name == name) {
        std::vector<double> v;
        for (const auto& row : rows_) v.push_back(row[j]);
        return v;
      }
    throw Error(ErrorKind::kWork, "no metric '" + name + "'", campaign_.identity.name);
  }
  struct Time {
    double t;
    std::string column;
  };
  // Metrics FRONT_at_NNNNs…, from a time on.
  std::vector<Time> over_time(const std::string& front, double from) const {
    std::vector<Time> out;
    for (const auto& c : campaign_.identity.columns)
      if (c.name.rfind(front + "_at_", 0) == 0)
        if (const double t = std::strtod(c.name.c_str() + front.size() + 4, nullptr); t >= from)
          out.push_back({t, c.name});
    return out;
  }
  double worst_q95(const std::string& front) const {
    double most = 0;
    for (const auto& at : over_time(front, 120))
      most = std::max(most, quantile(column(at.column), 0.95));
    return most;
  }
  double at_end(const std::string& front, double q) const {
    return quantile(column(over_time(front, 120).back().column), q);
  }
  const std::string& name() const { return name_; }

 private:
  std::string name_;
  Campaign campaign_;
  std::vector<std::vector<double>> rows_;
};

const struct {
  const char *name, *front;
  bool shown;
} kErrors[] = {{"INS alone", "segmented_ins", true},
               {"dead reckoning, calibrated at the switch", "segmented_reckoned", true},
               {"weighted (covariance intersection)", "segmented_intersection", true},
               {"weighted (minimum variance)", "segmented_weighted", true},
               {"weighted (naive)", "segmented_naive", false},
               {"joint filter", "segmented_joint", true}};

void figures(const Route& route, Paper& paper) {
  report::Fan fan;
  fan.title = fmt::format("Scale found in the first three minutes, {} route", route.name());
  fan.caption =
      "The preset error of 2 % as phase 1 finds it, quantiles over the runs; the paper promises 90 "
      "% of it within two minutes.";
  fan.x = {"time", "s"};
  fan.y = {"scale error found", "%"};
  const auto early = route.over_time("segmented_scale", 0);
  for (const auto& at : early) fan.at.push_back(at.t);
  for (double q : {5.0, 50.0, 95.0}) {
    report::Percentile p;
    p.percent = q;
    for (const auto& at : early) p.y.push_back(100 * quantile(route.column(at.column), q / 100));
    fan.percentiles.push_back(p);
  }
  paper.figures.push_back({fmt::format("scale-{}", route.name()), fan});

  report::Series f;
  f.title = fmt::format("Position error, 95 % of the runs, {} route", route.name());
  f.caption =
      "Per cent of the distance run. The INS alone grows; the dead reckoning, calibrated by it in "
      "the first two minutes, stays at the floor that the alignment's azimuth error sets; "
      "weighting "
      "gains little over it. The joint filter gains where the route turns.";
  f.x = {"time", "min"};
  f.y = {"95 % of the position error", "% of distance", true};
  f.marks.push_back({0.2, "claimed", true});
  for (const auto& at : route.over_time(kErrors[0].front, 120)) f.at.push_back(at.t / 60);
  for (const auto& e : kErrors) {
    report::Curve c;
    c.name = e.name;
    c.shown = e.shown;
    for (const auto& at : route.over_time(e.front, 120))
      c.y.push_back(quantile(route.column(at.column), 0.95));
    f.curves.push_back(c);
  }
  paper.figures.push_back({fmt::format("error-{}", route.name()), f});
}

constexpr const char* kPage = R"md(## wang2012: Wang et al., INS first, dead reckoning later

*Wang D., Cai J., Lin X., Yang F., Liu Z., Chen X., method of improving the positioning precision about inertial positioning and heading
system for land vehicle, Journal of Chinese Inertial Technology 20(2), 2012 (in Chinese; only a fragment is known).*

**Question.** A vehicle without GNSS that may not stop. Its INS is good for two minutes and bad for an hour; its odometer, with unknown
scale and mounting, is the other way round. Can each correct the other?

**Method.** For the first two minutes the INS calibrates the dead reckoning (a Kalman filter of four states); then the calibrated dead
reckoning corrects the INS, and the two are weighted throughout. Weights, scenario and tables are missing from the fragment; what stands
here is completed from first principles (vehicle.md 6, 7) and simulated with a non-linear truth, {{runs:.0f}} hours on each of three
routes.

**What holds.** "90 % of scale and mounting within two minutes": in every run; the worst found {{W3-2min-K/worst:.3f}} of the scale and
{{W3-2min-mu/worst:.3f}} of the angle, half of them more than {{W3-2min-K/median:.3f}} and {{W3-2min-mu/median:.3f}}. "0.2 % of the
distance": in 95 of 100 runs at any time, {{W3-weighted/straight:.3f}} (straight), {{W3-weighted/mixed:.3f}} (mixed) and
{{W3-weighted/closed:.3f}} (closed). The neglect of the shared azimuth error is right for a start from rest (slope {{W3-phiU:.3f}}).

**What does not.** The margin is narrow and none of the method's merit: the error is the alignment's azimuth error, {{W3-floor/median:.3f}} %
in the median and {{W3-floor/q95:.3f}} % at 95 %; no weighting removes it on a straight road. And the weighting itself gains little: the
calibrated dead reckoning alone ends at {{W3-dr/median:.3f}} / {{W3-dr/q95:.3f}} % (median, 95 %) after an hour, where the INS alone has
{{W3-ins/median:.2f}} / {{W3-ins/q95:.2f}} %.

**What loxo does instead.** The segmented method as it is (`--mode segmented`), with weights that know of the common errors, and beside it
one joint filter through all phases: {{W3-joint-mixed:.3f}} % mixed (95 % after an hour), better by the more the road turns. Straight on
it gains nothing: {{joint-straight-median:.3f}} / {{W3-joint-straight:.3f}} % (median, 95 %), as the azimuth error stays. With wheel,
non-holonomic and standstill measurements it is `--mode filter`. All of 7.3, with the filter of 31 states:
[acceptance.md](acceptance.md).
)md";

}  // namespace

Paper wang2012(const Options& o) {
  Paper paper;
  paper.name = "wang2012";
  paper.title = "INS first, dead reckoning later";
  paper.reference =
      "Wang, Cai, Lin, Yang, Liu and Chen 2012: a method of improving the positioning precision of "
      "a "
      "land vehicle (in Chinese; a fragment). WGS84, 40 N, navigation-grade sensors.";
  Book book(paper, kClaims);
  const auto n = static_cast<std::size_t>(o.runs > 0 ? o.runs : o.full ? 400 : 100);
  const std::array<const char*, 3> names = {"straight", "mixed", "closed"};
  std::array<std::unique_ptr<Route>, 3> routes;
  std::atomic<std::size_t> done{0};
  for (std::size_t i = 0; i < 3; ++i) {
    // The same vehicles on every route.
    routes[i] = std::make_unique<Route>(names[i], o, n, o.seed);
    Route& route = *routes[i];
    const auto pieces = route.pieces();
    run_parallel(pieces, o.threads, [&](std::size_t k) {
      route.run(k);
      if (o.progress) o.progress(static_cast<double>(++done) / static_cast<double>(3 * pieces));
    });
    figures(route, paper);
    book.add(fmt::format("W3-weighted/{}", names[i]), route.worst_q95("segmented_intersection"));
  }
  paper.numbers["runs"] = static_cast<double>(n);
  report::Cdf scale, mounting;
  scale.title = "Share of the preset scale found after 120 s";
  mounting.title = "Share of the preset mounting angle found after 120 s";
  scale.caption = mounting.caption = "Over all runs; the paper claims 90 %.";
  scale.x = mounting.x = {"found", "%"};
  scale.percentiles = mounting.percentiles = {5, 50};
  std::vector<double> k, mu, k60, azimuth;
  double sxx = 0, sxy = 0;
  report::Table table;
  table.title = "After an hour, median / 95 %, per cent of distance";
  table.columns = {{"", ""}, {"straight", ""}, {"mixed", ""}, {"closed", ""}};
  for (const auto& route : routes) {
    report::Sample a{route->name(), {}}, b{route->name(), {}};
    const auto found = route->column("segmented_scale_found_pct"),
               early = route->column("segmented_scale_found_60_pct"),
               angle = route->column("segmented_mounting_120_rad"),
               phi = route->column("start_azimuth_rad");
    for (std::size_t j = 0; j < n; ++j) {
      // Of the angle as the paper has it, whatever the model makes of its sign.
      const double off = angle[j] + (o.model.angle_sign - 1) * deg;
      k.push_back(found[j] / 100), k60.push_back(early[j] / 100);
      mu.push_back(1 - std::fabs(off) / deg);
      azimuth.push_back(std::fabs(phi[j]) * 100);
      sxx += phi[j] * phi[j], sxy += phi[j] * off;
      a.values.push_back(found[j]), b.values.push_back(100 * mu.back());
    }
    scale.samples.push_back(a);
    mounting.samples.push_back(b);
  }
  for (const auto& e : kErrors) {
    report::Row row;
    row.cells.push_back(report::Cell(e.name));
    for (const auto& route : routes)
      row.cells.push_back(report::Cell(fmt::format("{:.3f} / {:.3f}", route->at_end(e.front, 0.5),
                                                   route->at_end(e.front, 0.95))));
    table.rows.push_back(row);
  }
  paper.tables.emplace_back(table);
  paper.figures.push_back({"found-scale", scale});
  paper.figures.push_back({"found-mounting", mounting});
  book.add("W3-2min-K/worst", quantile(k, 0));
  book.add("W3-2min-K/q05", quantile(k, 0.05));
  book.add("W3-2min-K/median", quantile(k, 0.5));
  book.add("W3-2min-mu/worst", quantile(mu, 0));
  book.add("W3-2min-mu/q05", quantile(mu, 0.05));
  book.add("W3-2min-mu/median", quantile(mu, 0.5));
  book.add("W3-60s-K/median", quantile(k60, 0.5));
  book.add("W3-60s-K/q05", quantile(k60, 0.05));
  book.add("W3-ins/median", routes[0]->at_end("segmented_ins", 0.5));
  book.add("W3-ins/q95", routes[0]->at_end("segmented_ins", 0.95));
  book.add("W3-dr/median", routes[0]->at_end("segmented_reckoned", 0.5));
  book.add("W3-dr/q95", routes[0]->at_end("segmented_reckoned", 0.95));
  book.add("W3-joint-straight", routes[0]->at_end("segmented_joint", 0.95));
  paper.numbers["joint-straight-median"] = routes[0]->at_end("segmented_joint", 0.5);
  book.add("W3-joint-mixed", routes[1]->at_end("segmented_joint", 0.95));
  book.add("W3-floor/median", quantile(azimuth, 0.5));
  book.add("W3-floor/q95", quantile(azimuth, 0.95));
  book.add("W3-phiU", sxy / sxx);
  book.close(kPage);
  return paper;
}

}  // namespace loxo::papers
