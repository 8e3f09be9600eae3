// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>

#include "cli/campaign.hpp"
#include "cli/command.hpp"
#include "loxo/ins/solution.hpp"
#include "loxo/num/error.hpp"
#include "loxo/report/json_sections.hpp"
#include "loxo/report/page_html.hpp"
#include "loxo/study/campaign_gates.hpp"
#include "loxo/study/statistics.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo::cli {
namespace {

std::atomic<bool> interrupted{false};
void on_interrupt(int) { interrupted = true; }

struct CampaignOptions {
  std::string file, store, against, metric;
  unsigned long long trials = 0, trial = 0;
  int threads = 0, worst = 10;
  bool list = false, require = false;
};

CampaignSource source_of(const std::string& file) {
  CampaignSource s;
  s.name = file;
  if (std::filesystem::is_regular_file(file)) {
    std::ifstream in(file, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    if (!in) throw Error(ErrorKind::kInput, "cannot be read", file);
    s.text = text.str();
    if (s.text.rfind("\xef\xbb\xbf", 0) == 0) s.text.erase(0, 3);
    return s;
  }
  std::vector<std::string> names;
  for (const auto& ready : ready_campaigns()) {
    names.push_back(ready.name);
    if (ready.name == file) {
      s.text = ready.text;
      return s;
    }
  }
  throw Error(ErrorKind::kInput,
              "no such campaign file, nor a ready campaign of that name" + suggestion(file, names),
              file);
}

Json to_json(const Summary& s) {
  Json j = {{"count", s.count}, {"bad", s.bad},
            {"mean", s.mean},   {"mean_95", {s.mean_lo, s.mean_hi}},
            {"std", s.std},     {"std_95", {s.std_lo, s.std_hi}},
            {"rms", s.rms},     {"min", s.least},
            {"max", s.most}};
  for (const auto& p : s.percentiles) {
    j[fmt::format("p{:02.0f}", p.at)] = p.value;
    j[fmt::format("p{:02.0f}_95", p.at)] = {p.lo, p.hi};
  }
  return j;
}

Json or_null(double x) { return std::isfinite(x) ? Json(x) : Json(); }
Json to_json(const GateResult& r) {
  Json j = {{"name", r.gate.name},
            {"of", meaning(r.gate)},
            {"value", or_null(r.value.value)},
            {"value_95", {or_null(r.value.lo), or_null(r.value.hi)}},
            {"expected", or_null(r.gate.expected)},
            {"at_least", or_null(r.gate.at_least)},
            {"at_most", or_null(r.gate.at_most)}};
  if (!r.where.empty()) j["at"] = r.where;
  j["met"] = r.judged ? Json(r.met) : Json();
  return j;
}
std::string number_of(const Json& j) {
  return j.is_number() ? fmt::format("{:.4g}", j.get<double>()) : std::string("-");
}
std::string bound_of(const Json& g) {
  if (g.at("at_least").is_number()) return ">= " + number_of(g.at("at_least"));
  if (g.at("at_most").is_number()) return "<= " + number_of(g.at("at_most"));
  return "-";
}
std::string verdict_of(const Json& g) {
  return g.at("met").is_null() ? "" : g.at("met").get<bool>() ? "met" : "MISSED";
}
std::string band_of(const Json& g) {
  const Json& b = g.at("value_95");
  return b[0].is_number() ? number_of(b[0]) + " to " + number_of(b[1]) : std::string();
}

std::string row_of(const Summary& s) {
  const auto at = [&](std::size_t i) {
    return i < s.percentiles.size() ? s.percentiles[i].value : std::nan("");
  };
  return fmt::format(
      "  {:<26} {:>12.5g} +- {:<9.2g} {:>12.5g} {:>12.5g} {:>12.5g} {:>12.5g} {:>12.5g}", s.name,
      s.mean, 0.5 * (s.mean_hi - s.mean_lo), s.std, at(0), at(2), at(4), s.most);
}
std::string heading() {
  return fmt::format("  {:<26} {:>12}    {:<9} {:>12} {:>12} {:>12} {:>12} {:>12}", "metric",
                     "mean", "95 %", "std", "5 %", "median", "95 %", "max");
}

// The way there (X_at_NNN) is for the page, --json and -v.
void say_rows(const Globals& globals, const std::vector<Summary>& list) {
  for (const auto& s : list)
    if (globals.verbose || s.name.rfind("_at_") == std::string::npos) say(globals, row_of(s));
}

// Trials shown in memory at most; longer stores are thinned evenly.
constexpr std::uint64_t kInMemory = 4'000'000;
std::uint64_t stride_of(const Store& s) {
  return std::max<std::uint64_t>(1, (s.trials() + kInMemory - 1) / kInMemory);
}

std::vector<Summary> summaries(const Store& store) {
  std::vector<Summary> list;
  for (const auto& c : store.identity().columns)
    if (!c.parameter) list.push_back(summarize(c.name, store.column(c.name, stride_of(store))));
  return list;
}

int run_command(const Globals& globals, const CampaignOptions& o, const CLI::App& sub) {
  if (o.list) {
    Json names = Json::array();
    for (const auto& ready : ready_campaigns()) {
      names.push_back(ready.name);
      say(globals, ready.name);
    }
    if (globals.json) print_json({{"command", "campaign run"}, {"ready", names}});
    return 0;
  }
  if (o.file.empty())
    throw Error(ErrorKind::kUsage,
                "expected a campaign file or the name of a ready campaign (--list)", "FILE");
  if (globals.output.empty())
    throw Error(ErrorKind::kUsage, "expected -o STORE, the file that will hold a row per trial",
                "-o");
  if (o.threads < 0)
    throw Error(ErrorKind::kUsage, "expected a number of threads, 0 for all", "--threads");
  CampaignSource source = source_of(o.file);
  source.sets = globals.sets;
  source.trials = o.trials;
  if (sub.count("--seed") > 0) source.seed = globals.seed;
  const Campaign campaign = read_campaign(source, LOXO_VERSION);

  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  std::signal(SIGXFSZ, SIG_IGN);  // a file-size limit is told as an error, not by a signal
  const Ranks ranks;
  Globals mine = globals;
  if (ranks.rank() != 0) mine.quiet = true;
  RunOptions run;
  run.store = globals.output;
  run.threads = o.threads;
  run.interrupted = &interrupted;
  RunResult result;
  {
    Progress progress(mine, campaign.identity.name,
                      static_cast<double>(campaign.trials) / ranks.size());
    run.progress = [&](double done) { progress.at(done); };
    result = run_campaign(campaign, run, ranks);
  }
  if (!result.complete)
    throw Error(
        ErrorKind::kWork,
        fmt::format("interrupted; {} trials of this process are safe, the same command resumes",
                    result.resumed + result.computed),
        globals.output);
  if (ranks.rank() != 0) return 0;
  const Store store(globals.output);
  const auto list = summaries(store);
  const double rate =
      result.seconds > 0 ? static_cast<double>(result.computed) / result.seconds : 0;
  if (globals.json) {
    Json metrics = Json::object();
    for (const auto& s : list) metrics[s.name] = to_json(s);
    print_json({{"command", "campaign run"},
                {"store", globals.output},
                {"name", campaign.identity.name},
                {"kind", campaign.identity.kind},
                {"seed", campaign.identity.seed},
                {"trials", store.trials()},
                {"computed", result.computed},
                {"resumed", result.resumed},
                {"stopped_by_rule", result.stopped_by_rule},
                {"seconds", result.seconds},
                {"trials_per_second", rate},
                {"threads", result.threads},
                {"ranks", ranks.size()},
                {"metrics", metrics}});
    return 0;
  }
  say(globals,
      fmt::format("{}: {} trials in {} ({} computed now, {} found done{}), {:.3g} a second",
                  campaign.identity.name, store.trials(), globals.output, result.computed,
                  result.resumed, result.stopped_by_rule ? ", stopped by its rule" : "", rate));
  say(globals, heading());
  say_rows(globals, list);
  say(globals, fmt::format("next: loxo campaign report {}", globals.output));
  return 0;
}

// The trials in which a metric is largest in size; those that are not numbers first.
std::vector<std::size_t> worst_of(const std::vector<double>& v, std::size_t count) {
  std::vector<std::size_t> order(v.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  count = std::min(count, order.size());
  const auto size = [&](std::size_t i) {
    return std::isfinite(v[i]) ? std::fabs(v[i]) : std::numeric_limits<double>::infinity();
  };
  std::partial_sort(
      order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end(),
      [&](std::size_t i, std::size_t j) { return size(i) != size(j) ? size(i) > size(j) : i < j; });
  order.resize(count);
  return order;
}

// Progress of metrics named X_at_NNN_unit (percent of the way) as a fan over the way.
void add_fans(report::Section& section, const std::vector<Summary>& list) {
  std::map<std::string, std::vector<std::pair<double, const Summary*>>> fans;
  std::map<std::string, std::string> units;  // X_at_0120s_…: times, not parts of the way
  for (const auto& s : list)
    if (const auto at = s.name.rfind("_at_"); at != std::string::npos) {
      char* end = nullptr;
      const double x = std::strtod(s.name.c_str() + at + 4, &end);
      fans[s.name.substr(0, at)].push_back({x, &s});
      if (*end == 's') units[s.name.substr(0, at)] = "s";
    }
  for (auto& [name, points] : fans) {
    std::sort(points.begin(), points.end());
    report::Fan fan;
    fan.title = name + " over the drive";
    fan.x = {units.contains(name) ? "time" : "part of the drive", units.contains(name) ? "s" : "%"};
    fan.y = {name, ""};
    for (const double percent : {5.0, 25.0, 50.0, 75.0, 95.0})
      fan.percentiles.push_back({percent, {}});
    for (const auto& [at, s] : points) {
      fan.at.push_back(at);
      for (std::size_t i = 0; i < 5; ++i)
        fan.percentiles[i].y.push_back(s->percentiles.size() > i ? s->percentiles[i].value
                                                                 : std::nan(""));
    }
    section.blocks.emplace_back(std::move(fan));
  }
}

// One error against another, with the ellipse of their covariance.
void add_error_ellipse(report::Section& section, const Store& store, const std::string& a,
                       const std::string& b) {
  const std::uint64_t stride = std::max<std::uint64_t>(1, store.trials() / 20000);
  const auto x = store.column(a, stride), y = store.column(b, stride);
  double n = 0, mx = 0, my = 0, sxx = 0, sxy = 0, syy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(x[i]) || !std::isfinite(y[i])) continue;
    n += 1;
    const double dx = x[i] - mx, dy = y[i] - my;
    mx += dx / n;
    my += dy / n;
    sxx += dx * (x[i] - mx);
    sxy += dx * (y[i] - my);
    syy += dy * (y[i] - my);
  }
  if (n < 3) return;
  const auto cx = report::column_of_key(a), cy = report::column_of_key(b);
  report::Scatter scatter;
  scatter.title = cx.title + " and " + cy.title;
  scatter.caption =
      "Each point a trial; the ellipse holds 95 % of a normal distribution with their covariance.";
  scatter.x = {cx.title, cx.unit};
  scatter.y = {cy.title, cy.unit};
  scatter.clouds.push_back({"trials", x, y});
  scatter.ellipses.push_back({"covariance", mx, my, sxx / (n - 1), sxy / (n - 1), syy / (n - 1)});
  section.blocks.emplace_back(std::move(scatter));
}
// Errors come in pairs: scale and angle of a method, east and north.
void add_error_ellipses(report::Section& section, const Store& store,
                        const std::vector<Summary>& list) {
  const auto paired = [](const std::string& name) {
    return name.find("_error") != std::string::npos || name == "east_end_m" ||
           name == "north_end_m" || name == "ve_end_mps" || name == "vn_end_mps";
  };
  for (std::size_t i = 0; i + 1 < list.size(); ++i)
    if (paired(list[i].name) && paired(list[i + 1].name)) {
      add_error_ellipse(section, store, list[i].name, list[i + 1].name);
      ++i;
    }
}

report::Section comparison(const Json& against) {
  report::Section section{"Held against " + against.at("name").get<std::string>(), {}, ""};
  report::Table t;
  t.title = "The other campaign minus this one";
  t.caption =
      "Difference of the means with its 95 % interval; a small p-value says that the distributions "
      "differ.";
  t.columns = {{"metric", ""}, {"difference", ""}, {"from", ""},
               {"to", ""},     {"paired", ""},     {"p-value", ""}};
  const auto value = [](const Json& j) { return j.is_number() ? j.get<double>() : std::nan(""); };
  for (const auto& [name, d] : against.at("metrics").items())
    t.rows.push_back(
        {{name, value(d.at("mean")), value(d.at("mean_95")[0]), value(d.at("mean_95")[1]),
          d.at("paired").get<bool>() ? "yes" : "no", value(d.at("p_value"))},
         false,
         ""});
  section.blocks.emplace_back(std::move(t));
  return section;
}

report::Page page_of(const std::string& path, const Store& store, const std::vector<Summary>& list,
                     const Json& result) {
  report::Page page;
  const auto& id = store.identity();
  page.title = "Campaign " + id.name;
  page.subtitle = fmt::format("{} trials of kind {}, seed {}", store.trials(), id.kind, id.seed);
  page.provenance = {{"program", "loxo " + id.version},
                     {"command", "loxo campaign report " + path}};
  report::Section metrics{"What came out", {}, ""};
  report::Table table;
  table.title = "Metrics";
  for (const char* title :
       {"metric", "mean", "std", "5 %", "median", "95 %", "max", "not computed"})
    table.columns.push_back({title, ""});
  for (const auto& s : list) {
    const auto at = [&](std::size_t i) {
      return i < s.percentiles.size() ? s.percentiles[i].value : std::nan("");
    };
    table.rows.push_back({{s.name,
                           {s.mean, (s.mean_hi - s.mean_lo) / 3.92},
                           {s.std, (s.std_hi - s.std_lo) / 3.92},
                           at(0),
                           at(2),
                           at(4),
                           s.most,
                           static_cast<double>(s.bad)},
                          false,
                          ""});
  }
  metrics.blocks.emplace_back(std::move(table));
  for (const auto& s : list) {
    if (s.name.rfind("_at_") != std::string::npos) continue;
    const auto values = store.column(s.name, std::max<std::uint64_t>(1, store.trials() / 20000));
    const auto column = report::column_of_key(s.name);
    report::Histogram h;
    h.title = column.title;
    h.x = {column.title, column.unit};
    h.samples.push_back({s.name, values});
    h.normal = true;
    const auto h_axis = h.x;
    metrics.blocks.emplace_back(std::move(h));
    report::Cdf cdf;
    cdf.title = column.title + ", cumulative";
    cdf.x = h_axis;
    cdf.samples.push_back({s.name, values});
    metrics.blocks.emplace_back(std::move(cdf));
  }
  add_error_ellipses(metrics, store, list);
  add_fans(metrics, list);
  page.sections.push_back(std::move(metrics));
  if (result.contains("against")) page.sections.push_back(comparison(result["against"]));

  if (result.contains("gates")) {
    report::Section gates{"Gates", {}, ""};
    report::Table g;
    g.title = "What was to be reached";
    for (const char* title : {"", "found", "95 %", "expected", "gate", "", "statistic"})
      g.columns.push_back({title, ""});
    for (const auto& j : result.at("gates"))
      g.rows.push_back(
          {{j.at("name").get<std::string>(), number_of(j.at("value")), band_of(j),
            number_of(j.at("expected")), bound_of(j), verdict_of(j), j.at("of").get<std::string>()},
           false,
           ""});
    gates.blocks.emplace_back(std::move(g));
    page.sections.push_back(std::move(gates));
  }

  report::Section matter{"What matters", {}, ""};
  for (const auto& [metric, influences] : result.at("sensitivity").items()) {
    report::Table t;
    t.title = "Which parameter matters for " + metric;
    for (const char* title : {"parameter", "share of the variance", "rank correlation"})
      t.columns.push_back({title, ""});
    for (const auto& i : influences)
      t.rows.push_back({{i.at("parameter").get<std::string>(), i.at("share").get<double>(),
                         i.at("rank_correlation").get<double>()},
                        false,
                        ""});
    if (!t.rows.empty()) matter.blocks.emplace_back(std::move(t));
  }
  if (!matter.blocks.empty()) page.sections.push_back(std::move(matter));

  report::Section worst{"Worst trials", {}, ""};
  report::Table t;
  t.title = "Largest " + result.at("worst_metric").get<std::string>();
  for (const char* title : {"trial", "value", "replay it alone"}) t.columns.push_back({title, ""});
  for (const auto& w : result.at("worst"))
    t.rows.push_back({{std::to_string(w.at("trial").get<std::uint64_t>()),
                       w.at("value").is_null() ? std::nan("") : w.at("value").get<double>(),
                       "`" + w.at("replay").get<std::string>() + "`"},
                      false,
                      ""});
  worst.blocks.emplace_back(std::move(t));
  page.sections.push_back(std::move(worst));
  return page;
}

// All that `report` says, by name.
Json result_of(const CampaignOptions& o, const Store& store, bool running,
               const std::vector<Summary>& list) {
  const auto& id = store.identity();
  std::vector<std::string> metrics, parameters;
  for (const auto& c : id.columns) (c.parameter ? parameters : metrics).push_back(c.name);
  const std::uint64_t stride = stride_of(store);

  std::string metric = o.metric.empty() ? metrics.front() : o.metric;
  if (std::find(metrics.begin(), metrics.end(), metric) == metrics.end())
    throw Error(ErrorKind::kUsage, "unknown metric '" + metric + "'" + suggestion(metric, metrics),
                "--metric");

  Json result = {{"command", "campaign report"},
                 {"store", o.store},
                 {"name", id.name},
                 {"kind", id.kind},
                 {"seed", id.seed},
                 {"version", id.version},
                 {"trials", store.trials()},
                 {"complete", !running}};
  result["bad_trials"] = store.bad_trials();
  result["metrics"] = Json::object();
  for (const auto& s : list) result["metrics"][s.name] = to_json(s);

  // What varies, against every metric; at most this many trials are ranked.
  constexpr std::uint64_t kRanked = 200'000;
  const std::uint64_t thin =
      std::max<std::uint64_t>(stride, (store.trials() + kRanked - 1) / kRanked);
  if (const auto gates = gates_of(id); !gates.empty()) {
    result["gates"] = Json::array();
    for (const auto& g :
         judge(gates, metrics, [&](const std::string& m) { return store.column(m, stride); }))
      result["gates"].push_back(to_json(g));
  }
  result["sensitivity"] = Json::object();
  std::vector<std::pair<std::string, std::vector<double>>> varied;
  for (const auto& p : parameters) {
    auto v = store.column(p, thin);
    if (std::any_of(v.begin(), v.end(), [&](double x) { return x != v.front(); }))
      varied.emplace_back(p, std::move(v));
  }
  for (const auto& m : metrics) {
    const auto v = store.column(m, thin);
    std::vector<double> size(v.size());
    std::transform(v.begin(), v.end(), size.begin(), [](double x) { return std::fabs(x); });
    std::vector<Influence> all;
    all.reserve(varied.size());
    // The size of an error: its sign says nothing about what matters.
    for (const auto& [name, x] : varied) all.push_back(influence(name, x, size));
    std::sort(all.begin(), all.end(),
              [](const Influence& a, const Influence& b) { return a.share > b.share; });
    result["sensitivity"][m] = Json::array();
    for (const auto& i : all)
      result["sensitivity"][m].push_back({{"parameter", i.parameter},
                                          {"share", i.share},
                                          {"rank_correlation", i.rank_correlation}});
  }
  const auto column = store.column(metric, stride);
  result["worst_metric"] = metric;
  result["worst"] = Json::array();
  for (const std::size_t i : worst_of(column, static_cast<std::size_t>(std::max(0, o.worst)))) {
    const std::uint64_t trial = i * stride;
    result["worst"].push_back(
        {{"trial", trial},
         {"value", column[i]},
         {"replay", fmt::format("loxo campaign replay {} --trial {}", o.store, trial)}});
  }
  if (!o.against.empty()) {
    const Store other(o.against);
    const auto& theirs = other.identity();
    const bool paired = theirs.seed == id.seed && other.trials() == store.trials();
    Json diff = Json::object();
    for (const auto& m : metrics) {
      const bool has = std::any_of(theirs.columns.begin(), theirs.columns.end(),
                                   [&](const auto& c) { return c.name == m; });
      if (!has) continue;
      const Difference d = difference(store.column(m, stride), other.column(m, stride_of(other)),
                                      paired && stride == stride_of(other));
      diff[m] = {{"mean", d.mean},
                 {"mean_95", {d.lo, d.hi}},
                 {"paired", d.paired},
                 {"ks", d.ks},
                 {"p_value", d.p_value}};
    }
    if (diff.empty())
      throw Error(ErrorKind::kInput, "the two campaigns have no metric in common", o.against);
    result["against"] = {{"store", o.against}, {"name", theirs.name}, {"metrics", diff}};
  }
  return result;
}

// Whole blocks of a campaign that still runs are merged first.
bool merge_if_running(const std::string& path) {
  const bool running = has_parts(path);
  if (running) merge_parts(path);
  return running;
}
void require_trials(const Store& store, const std::string& path) {
  if (store.trials() == 0)
    throw Error(ErrorKind::kInput, "no whole block of trials yet; ask again later", path);
}

int report_command(const Globals& globals, const CampaignOptions& o) {
  const bool running = merge_if_running(o.store);
  const Store store(o.store);
  require_trials(store, o.store);
  const auto& id = store.identity();
  const auto list = summaries(store);
  Json result = result_of(o, store, running, list);
  if (!globals.output.empty())
    report::write_page(page_of(o.store, store, list, result), globals.output);
  std::string missed;
  if (o.require) {
    if (!result.contains("gates"))
      throw Error(ErrorKind::kInput, "the campaign's file has no [[gate]]; expected one or more",
                  o.store);
    for (const auto& g : result["gates"])
      if (verdict_of(g) == "MISSED")
        missed += fmt::format("{}{}: {}, required {}", missed.empty() ? "" : "; ",
                              g["name"].get<std::string>(), number_of(g["value"]), bound_of(g));
  }
  const auto verdict = [&] {
    if (!missed.empty()) throw Error(ErrorKind::kRequirement, missed, "gate missed");
    return 0;
  };
  if (globals.json) {
    print_json(result);
    return verdict();
  }
  say(globals, fmt::format("{}: {} trials{}, kind {}, seed {}, {} with something not computed",
                           id.name, store.trials(), running ? " so far" : "", id.kind, id.seed,
                           result["bad_trials"].get<long long>()));
  say(globals, heading());
  say_rows(globals, list);
  if (result.contains("gates")) {
    say(globals, fmt::format("\n  {:<52} {:>10} {:>22} {:>10} {:>10}", "gate", "found", "95 %",
                             "expected", "required"));
    for (const auto& g : result["gates"])
      say(globals, fmt::format("  {:<52} {:>10} {:>22} {:>10} {:>10} {}",
                               g["name"].get<std::string>(), number_of(g["value"]), band_of(g),
                               number_of(g["expected"]), bound_of(g), verdict_of(g)));
  }
  const auto metric = result["worst_metric"].get<std::string>();
  if (!result["sensitivity"][metric].empty()) {
    say(globals,
        fmt::format("\n  what matters for |{}|: share of its variance (rank correlation)", metric));
    for (const auto& i : result["sensitivity"][metric])
      say(globals,
          fmt::format("  {:<26} {:>6.1f} %  ({:+.2f})", i["parameter"].get<std::string>(),
                      100 * i["share"].get<double>(), i["rank_correlation"].get<double>()));
  }
  if (result.contains("against")) {
    say(globals, fmt::format("\n  {} minus {}", o.against, o.store));
    for (const auto& [name, d] : result["against"]["metrics"].items())
      say(globals,
          fmt::format("  {:<26} {:>12.5g}  95 %: {:.5g} to {:.5g}{}  KS p = {:.3g}", name,
                      d["mean"].get<double>(), d["mean_95"][0].get<double>(),
                      d["mean_95"][1].get<double>(), d["paired"].get<bool>() ? " (paired)" : "",
                      d["p_value"].get<double>()));
  }
  say(globals, fmt::format("\n  worst trials by {}", metric));
  for (const auto& w : result["worst"])
    say(globals, fmt::format("  {:>12.5g}  {}",
                             w["value"].is_number() ? w["value"].get<double>() : std::nan(""),
                             w["replay"].get<std::string>()));
  return verdict();
}

int replay_command(const Globals& globals, const CampaignOptions& o) {
  const StoreIdentity id = read_identity(o.store);
  const Campaign campaign = campaign_of(id, LOXO_VERSION, o.store);
  if (has_parts(o.store)) merge_parts(o.store);
  const Store store(o.store);
  const auto held = store.row(o.trial);
  const auto again = run_trial(campaign, o.trial);
  bool same = true;
  Json parameters = Json::object(), metrics = Json::object();
  for (std::size_t j = 0; j < id.columns.size(); ++j) {
    same = same && (held[j] == again[j] || (std::isnan(held[j]) && std::isnan(again[j])));
    (id.columns[j].parameter ? parameters : metrics)[id.columns[j].name] = again[j];
  }
  const auto health = static_cast<unsigned>(again.back());
  if (globals.json) {
    print_json({{"command", "campaign replay"},
                {"store", o.store},
                {"trial", o.trial},
                {"seed", id.seed},
                {"same_bits", same},
                {"health", health},
                {"parameters", parameters},
                {"metrics", metrics}});
  } else {
    say(globals,
        fmt::format("trial {} of {}, alone in double: {}", o.trial, id.name,
                    same ? "the same bits as in the store" : "OTHER BITS than in the store"));
    for (std::size_t j = 0; j < id.columns.size(); ++j)
      say(globals,
          fmt::format("  {:<9} {:<26} {:<24} {}", id.columns[j].parameter ? "parameter" : "metric",
                      id.columns[j].name, again[j], id.columns[j].meaning));
    if ((health & kHealthDomain) != 0)
      say(globals, "  health: a metric could not be computed (outside its domain)");
  }
  if (!same)
    throw Error(ErrorKind::kWork,
                fmt::format("trial {} gives other bits here than in the store", o.trial), o.store);
  return 0;
}

}  // namespace

report::Page campaign_page(const std::string& path) {
  CampaignOptions o;
  o.store = path;
  const bool running = merge_if_running(path);
  const Store store(path);
  require_trials(store, path);
  const auto list = summaries(store);
  return page_of(path, store, list, result_of(o, store, running, list));
}

void add_campaign(CLI::App& app, Globals& globals) {
  auto* campaign = add_command(
      app, globals, "campaign", "Monte Carlo: many trials on lanes, threads and machines",
      "loxo campaign run leg-length -o legs.sqlite",
      []() -> int { throw Error(ErrorKind::kUsage, "expected one of run, report, replay"); });
  auto o = std::make_shared<CampaignOptions>();
  // --seed replaces the file's only where it was given: the command looks at its own options.
  CLI::App* sub = nullptr;
  auto holder = std::make_shared<CLI::App*>(nullptr);
  sub =
      add_subcommand(*campaign, globals, "run", "run or resume a campaign",
                     "loxo campaign run leg-length -o legs.sqlite",
                     [o, &globals, holder]() -> int { return run_command(globals, *o, **holder); });
  *holder = sub;
  sub->add_option("FILE", o->file, "campaign file (TOML) or the name of a ready campaign");
  sub->add_option("--threads", o->threads, "threads of this process (default: all)");
  sub->add_option("--trials", o->trials, "number of trials, instead of the file's");
  sub->add_flag("--list", o->list, "names of the ready campaigns");
  sub = add_subcommand(
      *campaign, globals, "report", "what a campaign says, at any time, also while it runs",
      "loxo campaign report legs.sqlite -o report.html",
      [o, &globals]() -> int { return report_command(globals, *o); }, Output::kPage);
  sub->add_option("STORE", o->store, "the store")->required();
  sub->add_option("--against", o->against, "another store to compare with");
  sub->add_option("--metric", o->metric, "whose worst trials are listed (default: the first)");
  sub->add_option("--worst", o->worst, "how many of them");
  sub->add_flag("--require", o->require, "exit 4 where a [[gate]] of the campaign is missed");
  sub = add_subcommand(*campaign, globals, "replay", "one trial again, alone",
                       "loxo campaign replay legs.sqlite --trial 4711",
                       [o, &globals]() -> int { return replay_command(globals, *o); });
  sub->add_option("STORE", o->store, "the store")->required();
  sub->add_option("--trial", o->trial, "number of the trial")->required();
}

}  // namespace loxo::cli
