// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/innovations_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "loxo/num/error.hpp"
#include "loxo/study/consistency.hpp"
#include "loxo/text/json.hpp"

namespace loxo {
namespace {

constexpr double kChi95 = 3.841458820694124;  // chi2 of one degree

const char* word(Verdict v) {
  return v == Verdict::kAsIs ? "used" : v == Verdict::kDeweighted ? "weighted" : "rejected";
}

void judge(SensorConsistency& s) {
  const Band band = chi_square_band(1, static_cast<double>(s.count));
  s.nis_low = band.low;
  s.nis_high = band.high;
  s.coloured = std::fabs(s.lag_one) >= 2.0 / std::sqrt(static_cast<double>(s.count));
}

std::vector<SensorConsistency> from_json(const std::string& path) {
  std::ifstream in(path);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const Json j = parse_json(text, path);
  if (!j.is_object() || !j.contains("innovations") || !j["innovations"].is_object())
    throw Error(ErrorKind::kInput,
                "no key 'innovations': expected the result of 'loxo navigate --mode filter --json'",
                path);
  std::vector<SensorConsistency> out;
  for (const auto& [name, e] : j["innovations"].items()) {
    SensorConsistency s;
    s.sensor = name;
    for (const char* key :
         {"used", "deweighted", "rejected", "nis_mean", "nis_above_95", "lag_one"})
      if (!e.is_object() || !e.contains(key) || !e[key].is_number())
        throw Error(ErrorKind::kInput, "a number expected",
                    path + ": innovations." + name + "." + key);
    s.deweighted = e["deweighted"].get<long>();
    s.rejected = e["rejected"].get<long>();
    s.count = e["used"].get<long>() + s.deweighted + s.rejected;
    s.nis_mean = e["nis_mean"].get<double>();
    s.nis_above_95 = e["nis_above_95"].get<double>();
    s.lag_one = e["lag_one"].get<double>();
    if (s.count <= 0) continue;
    judge(s);
    out.push_back(s);
  }
  return out;
}

// The sums of one sensor while its file is read.
struct Sums {
  SensorConsistency s;
  double t = NAN;             // of the last row
  std::size_t component = 0;  // of the next row at this time
  std::vector<double> last;   // normalised innovation of each component, NaN: none
  double square = 0, lag = 0;
};

}  // namespace

InnovationWriter::InnovationWriter(const std::string& path) : file_(path) {
  file_.write("t_s,sensor,innovation,std,verdict\n");
}
void InnovationWriter::innovation(const Innovation& i) {
  line_.clear();
  append_number(line_, i.t);
  line_ += ',';
  line_ += sensor_name(i.sensor);
  line_ += ',';
  append_number(line_, i.y);
  line_ += ',';
  append_number(line_, std::sqrt(i.variance));
  line_ += ',';
  line_ += word(i.verdict);
  line_ += '\n';
  file_.write(line_);
  ++rows_;
}

std::vector<SensorConsistency> read_innovations(const std::string& path, double from, double to,
                                                Diagnostics& diagnostics) {
  {
    std::ifstream in(path);
    if (in && (in >> std::ws).peek() == '{') return from_json(path);
  }
  CsvReader reader(path);
  reader.select({"t_s", "innovation", "std"});
  const std::size_t sensor = reader.index("sensor");
  const bool verdicts = reader.has("verdict");
  const std::size_t verdict = verdicts ? reader.index("verdict") : 0;
  std::vector<Sums> all;
  double row[3];
  while (reader.next(row, diagnostics)) {
    const double t = row[0], n = row[1] / row[2];
    const std::string name(reader.cells()[sensor]);
    if (!(row[2] > 0) || !std::isfinite(n) || !std::isfinite(t) || name.empty()) {
      diagnostics.bad("bad_row", fmt::format("{}:{}", path, reader.line()),
                      "an innovation, a std above 0 and a sensor's name expected");
      continue;
    }
    if (t < from || t > to) continue;
    Sums* s = nullptr;
    for (auto& x : all)
      if (x.s.sensor == name) s = &x;
    if (!s) {
      all.emplace_back();
      s = &all.back();
      s->s.sensor = name;
    }
    s->component = t == s->t ? s->component + 1 : 0;
    s->t = t;
    if (s->component >= s->last.size()) s->last.push_back(NAN);
    double& last = s->last[s->component];
    if (std::isfinite(last)) s->lag += last * n;
    last = n;
    s->square += n * n;
    s->s.count += 1;
    s->s.nis_above_95 += n * n > kChi95;
    if (verdicts) {
      s->s.deweighted += reader.cells()[verdict] == "weighted";
      s->s.rejected += reader.cells()[verdict] == "rejected";
    }
  }
  std::vector<SensorConsistency> out;
  for (auto& x : all) {
    const auto count = static_cast<double>(x.s.count);
    x.s.nis_mean = x.square / count;
    x.s.nis_above_95 /= count;
    x.s.lag_one = x.square > 0 ? x.lag / x.square : 0.0;
    judge(x.s);
    out.push_back(x.s);
  }
  if (out.empty())
    throw Error(ErrorKind::kInput, "no innovation in this file, or none in the time asked for",
                path);
  return out;
}

}  // namespace loxo
