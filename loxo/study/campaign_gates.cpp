// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/campaign_gates.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "loxo/num/error.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
using Statistic = CampaignGate::Statistic;
constexpr std::pair<const char*, Statistic> kStatistics[] = {{"mean", Statistic::kMean},
                                                             {"std", Statistic::kStd},
                                                             {"percentile", Statistic::kPercentile},
                                                             {"least", Statistic::kLeast},
                                                             {"most", Statistic::kMost},
                                                             {"slope", Statistic::kSlope}};

bool known(const std::vector<std::string>& metrics, const std::string& name) {
  return std::find(metrics.begin(), metrics.end(), name) != metrics.end();
}
// Members of a family and their times, in order.
struct Member {
  std::string metric, time;  // "0120s"
};
std::vector<Member> family(const std::vector<std::string>& metrics, const std::string& front,
                           double from) {
  std::vector<Member> out;
  const std::string prefix = front + "_at_";
  for (const auto& m : metrics) {
    if (m.rfind(prefix, 0) != 0) continue;
    const std::string rest = m.substr(prefix.size());
    char* end = nullptr;
    const double t = std::strtod(rest.c_str(), &end);
    if (*end == 's' && t < from) continue;
    out.push_back({m, rest.substr(0, rest.find('_'))});
  }
  return out;
}
std::vector<std::string> names_of(const std::vector<std::string>& metrics) {
  std::vector<std::string> names;
  for (const auto& m : metrics) {
    const auto at = m.rfind("_at_");
    const std::string name = at == std::string::npos ? m : m.substr(0, at);
    if (names.empty() || names.back() != name) names.push_back(name);
  }
  return names;
}
std::string need_metric(const TomlTable& t, const std::string& key, const std::string& name,
                        const std::vector<std::string>& metrics, bool families) {
  if (known(metrics, name) || (families && !family(metrics, name, 0).empty())) return name;
  throw Error(ErrorKind::kInput,
              "unknown metric '" + name + "'" + suggestion(name, names_of(metrics)), t.where(key));
}

Interval interval_of(const CampaignGate& g, const std::vector<double>& all,
                     const std::vector<double>& x) {
  std::vector<double> v;
  double sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!std::isfinite(all[i])) continue;
    v.push_back(all[i]);
    if (g.statistic == Statistic::kSlope && std::isfinite(x[i]))
      sxx += x[i] * x[i], sxy += x[i] * all[i];
  }
  if (v.empty()) return {kNaN, kNaN, kNaN};
  const auto n = static_cast<double>(v.size());
  switch (g.statistic) {
    case Statistic::kLeast: {
      const double least = *std::min_element(v.begin(), v.end());
      return {least, kNaN, kNaN};
    }
    case Statistic::kMost: {
      const double most = *std::max_element(v.begin(), v.end());
      return {most, kNaN, kNaN};
    }
    case Statistic::kSlope: {
      if (!(sxx > 0) || n < 3) return {kNaN, kNaN, kNaN};
      const double slope = sxy / sxx;
      double rest = 0;
      for (std::size_t i = 0; i < all.size(); ++i)
        if (std::isfinite(all[i]) && std::isfinite(x[i]))
          rest += (all[i] - slope * x[i]) * (all[i] - slope * x[i]);
      const double half = 1.96 * std::sqrt(rest / (n - 1) / sxx);
      return {slope, slope - half, slope + half};
    }
    default:
      break;
  }
  const auto statistic = g.statistic == Statistic::kMean  ? StopRule::Statistic::kMean
                         : g.statistic == Statistic::kStd ? StopRule::Statistic::kStd
                                                          : StopRule::Statistic::kPercentile;
  Interval i = confidence_interval(v, statistic, g.percentile, 0.95);
  if (std::isfinite(i.value)) return i;
  // Too few for an interval.
  std::sort(v.begin(), v.end());
  double mean = 0, squares = 0;
  for (const double y : v) mean += y / n;
  for (const double y : v) squares += (y - mean) * (y - mean);
  const double at = g.percentile / 100 * (n - 1);
  const auto k = std::min(static_cast<std::size_t>(at), v.size() - 1);
  const double p =
      k + 1 < v.size() ? v[k] + (at - static_cast<double>(k)) * (v[k + 1] - v[k]) : v[k];
  i.value = g.statistic == Statistic::kMean  ? mean
            : g.statistic == Statistic::kStd ? std::sqrt(squares / std::max(1.0, n - 1))
                                             : p;
  return i;
}

}  // namespace

namespace {

CampaignGate read_gate(const TomlTable& t, const std::vector<std::string>& metrics) {
  CampaignGate g;
  g.metric = need_metric(t, "metric", t.need_string("metric"), metrics, true);
  g.name = t.get_string("name").value_or(g.metric);
  const bool over_time = !known(metrics, g.metric);
  std::vector<std::string> statistics;
  const std::string s = t.get_string("statistic").value_or("percentile");
  bool found = false;
  for (const auto& [name, statistic] : kStatistics) {
    statistics.emplace_back(name);
    if (s == name) g.statistic = statistic, found = true;
  }
  if (!found)
    throw Error(ErrorKind::kInput, "unknown statistic '" + s + "'" + suggestion(s, statistics),
                t.where("statistic"));
  g.percentile = t.get_number("percentile").value_or(50.0);
  if (!(g.percentile > 0 && g.percentile < 100))
    throw Error(ErrorKind::kInput, "expected a percentile between 0 and 100",
                t.where("percentile"));
  if (g.statistic == Statistic::kSlope)
    g.on = need_metric(t, "on", t.need_string("on"), metrics, false);
  for (const auto& name : t.get_strings("per").value_or(std::vector<std::string>{}))
    g.per.push_back(need_metric(t, "per", name, metrics, true));
  g.from = t.get_quantity("from", Dimension::kTime).value_or(0.0);
  if (!over_time && (t.has("per") || t.has("from")))
    throw Error(
        ErrorKind::kInput,
        "'" + g.metric + "' is one number a trial; expected the front of a family over time",
        t.where(t.has("per") ? "per" : "from"));
  if (over_time && family(metrics, g.metric, g.from).empty())
    throw Error(ErrorKind::kInput, "no time of '" + g.metric + "' is that late", t.where("from"));
  const auto members = family(metrics, g.metric, g.from).size();
  for (const auto& name : g.per)
    if (family(metrics, name, g.from).size() != members)
      throw Error(ErrorKind::kInput, "'" + name + "' has other times than '" + g.metric + "'",
                  t.where("per"));
  g.expected = t.get_number("expected").value_or(kNaN);
  g.at_least = t.get_number("at_least").value_or(kNaN);
  g.at_most = t.get_number("at_most").value_or(kNaN);
  return g;
}

}  // namespace

std::vector<CampaignGate> read_gates(const TomlTable& campaign,
                                     const std::vector<std::string>& metrics, bool varied) {
  std::vector<CampaignGate> out;
  const auto has = [&](const std::string& name) {
    return known(metrics, name) || !family(metrics, name, 0).empty();
  };
  for (const TomlTable& t : campaign.get_tables("gate")) {
    if (varied) {
      bool all = has(t.need_string("metric")) && has(t.get_string("on").value_or(metrics.front()));
      for (const auto& name : t.get_strings("per").value_or(std::vector<std::string>{}))
        all = all && has(name);
      if (!all) {
        for (const auto& key : t.keys()) static_cast<void>(t.has(key));
        continue;
      }
    }
    out.push_back(read_gate(t, metrics));
  }
  return out;
}

std::vector<CampaignGate> gates_of(const StoreIdentity& identity) {
  TomlTable table = TomlTable::parse(identity.source, identity.name);
  for (const auto& set : identity.sets)
    if (const auto equals = set.find('='); equals != std::string::npos)
      table.set(set.substr(0, equals), set.substr(equals + 1));
  std::vector<std::string> metrics;
  for (const auto& c : identity.columns)
    if (!c.parameter) metrics.push_back(c.name);
  return read_gates(table, metrics, !identity.sets.empty());
}

std::vector<GateResult> judge(
    const std::vector<CampaignGate>& gates, const std::vector<std::string>& metrics,
    const std::function<std::vector<double>(const std::string&)>& column) {
  std::vector<GateResult> out;
  for (const CampaignGate& g : gates) {
    GateResult r;
    r.gate = g;
    r.value = {kNaN, kNaN, kNaN};
    std::vector<double> on;
    if (!g.on.empty()) on = column(g.on);
    if (known(metrics, g.metric)) {
      r.value = interval_of(g, column(g.metric), on);
    } else {
      const auto members = family(metrics, g.metric, g.from);
      std::vector<std::vector<Member>> others;
      for (const auto& name : g.per) others.push_back(family(metrics, name, g.from));
      const bool low = std::isfinite(g.at_least);
      for (std::size_t i = 0; i < members.size(); ++i) {
        Interval v = interval_of(g, column(members[i].metric), on);
        if (!others.empty()) {
          double smallest = std::numeric_limits<double>::infinity();
          for (const auto& o : others)
            smallest = std::min(smallest, interval_of(g, column(o[i].metric), on).value);
          v = {v.value / smallest, kNaN, kNaN};
        }
        if (!std::isfinite(r.value.value) ||
            (low ? v.value < r.value.value : v.value > r.value.value))
          r.value = v, r.where = members[i].time;
      }
    }
    r.judged = std::isfinite(g.at_least) || std::isfinite(g.at_most);
    // What could not be computed is not met.
    r.met = !r.judged || (std::isfinite(r.value.value) &&
                          !(std::isfinite(g.at_least) && r.value.value < g.at_least) &&
                          !(std::isfinite(g.at_most) && r.value.value > g.at_most));
    out.push_back(std::move(r));
  }
  return out;
}

std::string meaning(const CampaignGate& g) {
  char text[40];
  std::snprintf(text, sizeof text, "%g %%", g.percentile);
  std::string s = g.statistic == Statistic::kMean         ? "mean"
                  : g.statistic == Statistic::kStd        ? "std"
                  : g.statistic == Statistic::kPercentile ? (g.percentile == 50 ? "median" : text)
                  : g.statistic == Statistic::kLeast      ? "least"
                  : g.statistic == Statistic::kMost       ? "most"
                                                          : "slope";
  s += " of " + g.metric;
  if (!g.on.empty()) s += " on " + g.on;
  for (std::size_t i = 0; i < g.per.size(); ++i) s += (i == 0 ? " per least of " : ", ") + g.per[i];
  if (g.from > 0) {
    std::snprintf(text, sizeof text, ", worst time from %g s", g.from);
    s += text;
  }
  return s;
}

}  // namespace loxo
