// SPDX-License-Identifier: Apache-2.0
// A campaign as TOML: kind, settings, distributions of parameters, stopping rule.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "loxo/num/error.hpp"
#include "loxo/study/campaign_gates.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo {
namespace {

using Kind = Distribution::Kind;
struct Shape {
  const char* key;
  Kind kind;
  std::size_t values;  // 0: any number of them
  const char* says;
};
constexpr Shape kShapes[] = {
    {"grid", Kind::kGrid, 0, "a list of values"},
    {"choice", Kind::kChoice, 0, "a list of values"},
    {"uniform", Kind::kUniform, 2, "[least, most]"},
    {"log_uniform", Kind::kLogUniform, 2, "[least, most]"},
    {"normal", Kind::kNormal, 2, "[mean, sigma]"},
    {"sobol", Kind::kSobol, 2, "[least, most]"},
    {"sobol_log", Kind::kSobolLog, 2, "[least, most]"},
    {"sobol_normal", Kind::kSobolNormal, 2, "[mean, sigma]"},
};

[[noreturn]] void impossible(const std::string& what, const std::string& where) {
  throw Error(ErrorKind::kInput, "impossible distribution: " + what, where);
}

Distribution read_distribution(const TomlTable& table, const ParameterInfo& info) {
  const Shape* found = nullptr;
  std::vector<std::string> names;
  for (const Shape& s : kShapes) {
    names.emplace_back(s.key);
    if (!table.has(s.key)) continue;
    if (found != nullptr)
      impossible(std::string("both '") + found->key + "' and '" + s.key + "'; choose one",
                 table.where(s.key));
    found = &s;
  }
  const auto keys = table.keys();
  for (const auto& k : keys)
    if (std::find(names.begin(), names.end(), k) == names.end())
      throw Error(ErrorKind::kInput, "unknown distribution '" + k + "'" + suggestion(k, names),
                  table.where(k));
  if (found == nullptr)
    impossible("expected one of grid, choice, uniform, log_uniform, normal, sobol …, found none",
               table.path());
  Distribution d;
  d.kind = found->kind;
  d.values = table.get_quantities(found->key, info.dimension).value();
  const std::string where = table.where(found->key);
  if (d.values.empty() || (found->values != 0 && d.values.size() != found->values))
    impossible(std::string("expected ") + found->says + ", found " +
                   std::to_string(d.values.size()) + " values",
               where);
  const bool normal = d.kind == Kind::kNormal || d.kind == Kind::kSobolNormal;
  const bool range = d.kind == Kind::kUniform || d.kind == Kind::kSobol ||
                     d.kind == Kind::kLogUniform || d.kind == Kind::kSobolLog;
  if (normal && !(d.values[1] >= 0)) impossible("a negative sigma", where);
  if (range && !(d.values[0] <= d.values[1])) impossible("least is above most", where);
  if ((d.kind == Kind::kLogUniform || d.kind == Kind::kSobolLog) && !(d.values[0] > 0))
    impossible("a logarithm needs positive bounds", where);
  const std::size_t placed = normal ? 1 : d.values.size();
  for (std::size_t i = 0; i < placed; ++i)
    if (!(d.values[i] >= info.least && d.values[i] <= info.most))
      impossible("'" + info.name + "' leaves its possible range", where);
  return d;
}

Distribution read_parameter(const TomlTable& table, const ParameterInfo& info) {
  std::optional<TomlTable> inner;
  try {
    inner = table.get_table(info.name);
  } catch (const Error&) {
    // Not a table: a fixed value.
  }
  if (inner) return read_distribution(*inner, info);
  const double v = table.get_quantity(info.name, info.dimension).value_or(info.standard);
  if (!(v >= info.least && v <= info.most))
    impossible("'" + info.name + "' leaves its possible range", table.where(info.name));
  return {Kind::kFixed, {v}};
}

std::string exact(double x) {
  char text[40];
  std::snprintf(text, sizeof text, "%a", x);
  return text;
}

StopRule read_stop(const TomlTable& table, const std::vector<MetricInfo>& metrics) {
  StopRule rule;
  std::vector<std::string> names;
  names.reserve(metrics.size());
  for (const auto& m : metrics) names.push_back(m.name);
  rule.metric = table.need_string("metric");
  if (std::find(names.begin(), names.end(), rule.metric) == names.end())
    throw Error(ErrorKind::kInput,
                "unknown metric '" + rule.metric + "'" + suggestion(rule.metric, names),
                table.where("metric"));
  const std::vector<std::string> statistics{"mean", "std", "percentile"};
  const std::string s = table.get_string("statistic").value_or("mean");
  if (std::find(statistics.begin(), statistics.end(), s) == statistics.end())
    throw Error(ErrorKind::kInput, "unknown statistic '" + s + "'" + suggestion(s, statistics),
                table.where("statistic"));
  rule.statistic = s == "mean"  ? StopRule::Statistic::kMean
                   : s == "std" ? StopRule::Statistic::kStd
                                : StopRule::Statistic::kPercentile;
  rule.percentile = table.get_number("percentile").value_or(50.0);
  rule.half_width = table.get_number("half_width").value_or(0.0);
  rule.relative = table.get_number("relative").value_or(0.0);
  rule.confidence = table.get_number("confidence").value_or(0.95);
  rule.at_least =
      static_cast<std::uint64_t>(std::max(8LL, table.get_integer("at_least").value_or(1000)));
  if (!(rule.percentile > 0 && rule.percentile < 100))
    throw Error(ErrorKind::kInput, "expected a percentile between 0 and 100",
                table.where("percentile"));
  if (!(rule.confidence > 0 && rule.confidence < 1))
    throw Error(ErrorKind::kInput, "expected a confidence between 0 and 1, as 0.95",
                table.where("confidence"));
  if (!(rule.half_width > 0) && !(rule.relative > 0))
    throw Error(ErrorKind::kInput,
                "expected half_width (in the metric's unit) or relative, above 0",
                table.where("metric"));
  return rule;
}

}  // namespace

Campaign read_campaign(const CampaignSource& source, const std::string& version) {
  TomlTable table = TomlTable::parse(source.text, source.name);
  for (const auto& set : source.sets) {
    const auto equals = set.find('=');
    if (equals == std::string::npos)
      throw Error(ErrorKind::kUsage, "expected key=value, found '" + set + "'", "--set");
    table.set(set.substr(0, equals), set.substr(equals + 1));
  }
  Campaign c;
  if (const auto format = table.get_integer("format"); format && *format != 1)
    throw Error(ErrorKind::kInput, "expected format = 1, found " + std::to_string(*format),
                table.where("format"));
  auto& id = c.identity;
  id.name = table.get_string("name").value_or(source.name);
  table.get_string("about");
  id.kind = table.need_string("kind");
  const TomlTable nothing = TomlTable::parse("", source.name);
  const TomlTable settings = table.get_table("settings").value_or(nothing);
  c.kind = make_trial_kind(id.kind, settings, table.where("kind"));

  const auto count = [&](const char* key, long long standard, long long most) {
    const long long n = table.get_integer(key).value_or(standard);
    if (n < 1 || n > most)
      throw Error(ErrorKind::kInput,
                  std::string("expected ") + key + " from 1 to " + std::to_string(most) +
                      ", found " + std::to_string(n),
                  table.where(key));
    return static_cast<std::uint64_t>(n);
  };
  c.trials = count("trials", 1000, 1LL << 40);
  if (source.trials != 0) c.trials = source.trials;
  id.seed = static_cast<std::uint64_t>(table.get_integer("seed").value_or(1));
  if (source.seed != 0) id.seed = source.seed;
  const auto grain = static_cast<std::uint64_t>(c.kind->grain());
  id.block =
      count("block", static_cast<long long>(std::max<std::uint64_t>(2 * grain, 64)), 1 << 20);
  // Blocks are made of whole pieces.
  id.block = (id.block + grain - 1) / grain * grain;

  const auto& infos = c.kind->parameters();
  std::vector<std::string> names;
  names.reserve(infos.size());
  for (const auto& p : infos) names.push_back(p.name);
  const TomlTable parameters = table.get_table("parameters").value_or(nothing);
  for (const auto& key : parameters.keys())
    if (std::find(names.begin(), names.end(), key) == names.end())
      throw Error(
          ErrorKind::kInput,
          "unknown parameter '" + key + "' of kind '" + id.kind + "'" + suggestion(key, names),
          parameters.where(key));
  std::vector<Distribution> distributions;
  id.config = "kind=" + id.kind + "\n" + c.kind->settings() + "\n";
  for (const auto& p : infos) {
    distributions.push_back(read_parameter(parameters, p));
    const auto& d = distributions.back();
    id.config += p.name + "=" + std::to_string(static_cast<int>(d.kind));
    for (double v : d.values) id.config += " " + exact(v);
    id.config += "\n";
    id.columns.push_back({p.column(), true, p.meaning});
  }
  for (const auto& m : c.kind->metrics()) id.columns.push_back({m.name, false, m.meaning});
  if (const auto stop = table.get_table("stop")) c.stop = read_stop(*stop, c.kind->metrics());
  std::vector<std::string> metrics;
  for (const auto& m : c.kind->metrics()) metrics.push_back(m.name);
  read_gates(table, metrics, !source.sets.empty());  // refused now, not when the campaign is over
  table.refuse_unknown();
  id.version = version;
  id.source = source.text;
  id.sets = source.sets;
  c.draws = Draws(std::move(distributions), id.seed);
  return c;
}

Campaign campaign_of(const StoreIdentity& identity, const std::string& version,
                     const std::string& store) {
  if (identity.version != version)
    throw Error(ErrorKind::kInput,
                "the store was written by program version " + identity.version + ", this is " +
                    version + "; replay it with that version",
                store);
  CampaignSource source;
  source.text = identity.source, source.name = identity.name, source.sets = identity.sets,
  source.seed = identity.seed;
  Campaign c = read_campaign(source, version);
  c.identity.block = identity.block;
  if (c.identity.hash() != identity.hash())
    throw Error(
        ErrorKind::kInput,
        "this program reads another campaign from the store's file than the one that was run",
        store);
  return c;
}

}  // namespace loxo
