// SPDX-License-Identifier: Apache-2.0
// NMEA 0183: positions, courses and headings out of talker sentences. Time is UTC seconds of the
// first day, of the sentence where it carries one, else of the log's stamp in front of it.
#include <array>
#include <cmath>
#include <map>

#include "loxo/log/foreign.hpp"
#include "loxo/num/error.hpp"
#include "loxo/text/gzip.hpp"

namespace loxo {
namespace {

struct Kind {
  const char* name;
  std::vector<std::string> header;
  const char* section;
};
const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all = {
      {"GGA", {"t_s", "lat_deg", "lon_deg", "h_m", "quality"}, "fix"},
      {"RMC", {"t_s", "lat_deg", "lon_deg", "speed_kn", "course_deg"}, "fix"},
      {"GLL", {"t_s", "lat_deg", "lon_deg"}, "fix"},
      {"VTG", {"t_s", "course_deg", "speed_kn"}, ""},
      {"HDT", {"t_s", "heading_deg"}, "heading"}};
  return all;
}

double number(const std::string& s) {
  char* end = nullptr;
  const double x = std::strtod(s.c_str(), &end);
  return s.empty() || *end != '\0' ? std::nan("") : x;
}
// ddmm.mmmm or dddmm.mmmm with its letter
double angle(const std::string& s, const std::string& letter) {
  const double x = number(s);
  const double d = std::floor(x / 100);
  const double v = d + (x - 100 * d) / 60;
  if (letter == "S" || letter == "W") return -v;
  return letter == "N" || letter == "E" ? v : std::nan("");
}
// hhmmss.ss
double clock(const std::string& s) {
  const double x = number(s);
  const double h = std::floor(x / 10000), m = std::floor(x / 100) - 100 * h;
  return 3600 * h + 60 * m + (x - 10000 * h - 100 * m);
}
// 2014-08-01T00:00:00.316000Z
double log_clock(const std::string& s) {
  const auto t = s.find('T');
  int h = 0, m = 0;
  double sec = 0;
  if (t == std::string::npos || std::sscanf(s.c_str() + t + 1, "%2d:%2d:%lf", &h, &m, &sec) != 3)
    return std::nan("");
  return 3600.0 * h + 60.0 * m + sec;
}
bool checked(const std::string& sentence) {
  const auto star = sentence.rfind('*');
  if (star == std::string::npos || star + 3 > sentence.size()) return true;
  unsigned sum = 0;
  for (std::size_t i = 1; i < star; ++i) sum ^= static_cast<unsigned char>(sentence[i]);
  return sum == std::strtoul(sentence.substr(star + 1, 2).c_str(), nullptr, 16);
}

struct Log {
  std::map<std::string, std::vector<std::vector<double>>> columns;
  std::map<std::string, std::size_t> others, damaged;
};

Log read_log(const std::string& path) {
  const std::string text = read_file(path);
  Log log;
  std::map<std::string, double> last, day;
  for (std::size_t from = 0; from < text.size();) {
    const auto end = std::min(text.find('\n', from), text.size());
    std::string line = text.substr(from, end - from);
    from = end + 1;
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
    const auto dollar = line.find('$');
    if (dollar == std::string::npos || line.size() < dollar + 7) continue;
    const double stamp = log_clock(line.substr(0, dollar));
    const std::string sentence = line.substr(dollar);
    const std::string name = sentence.substr(3, 3);
    const Kind* kind = nullptr;
    for (const Kind& k : kinds())
      if (name == k.name) kind = &k;
    if (kind == nullptr) {
      ++log.others[name];
      continue;
    }
    if (!checked(sentence)) {
      ++log.damaged[name];
      continue;
    }
    std::vector<std::string> cell;
    const std::string body = sentence.substr(0, sentence.find('*'));
    for (std::size_t at = 0; at <= body.size();) {
      const auto comma = std::min(body.find(',', at), body.size());
      cell.push_back(body.substr(at, comma - at));
      at = comma + 1;
    }
    cell.resize(std::max<std::size_t>(cell.size(), 12));
    std::vector<double> row;
    if (name == "GGA")
      // Above the ellipsoid: above the sea, and the geoid where it is given.
      row = {clock(cell[1]), angle(cell[2], cell[3]), angle(cell[4], cell[5]),
             number(cell[9]) + (cell[11].empty() ? 0.0 : number(cell[11])), number(cell[6])};
    else if (name == "RMC")
      row = {clock(cell[1]), angle(cell[3], cell[4]), angle(cell[5], cell[6]), number(cell[7]),
             number(cell[8])};
    else if (name == "GLL")
      row = {cell[5].empty() ? stamp : clock(cell[5]), angle(cell[1], cell[2]),
             angle(cell[3], cell[4])};
    else if (name == "VTG")
      row = {stamp, number(cell[1]), number(cell[5])};
    else
      row = {stamp, number(cell[1])};
    if (!std::isnan(row[0])) {
      if (last.contains(name) && row[0] + day[name] < last[name] - 43200) day[name] += 86400;
      row[0] += day[name];
      last[name] = row[0];
    }
    auto& columns = log.columns[name];
    columns.resize(row.size());
    for (std::size_t i = 0; i < row.size(); ++i) columns[i].push_back(row[i]);
  }
  return log;
}

}  // namespace

std::vector<std::string> nmea_tables(const std::string& path) {
  const Log log = read_log(path);
  std::vector<std::string> out;
  for (const Kind& k : kinds())
    if (log.columns.contains(k.name)) out.emplace_back(k.name);
  return out;
}

std::unique_ptr<Table> open_nmea(const std::string& path, const std::string& table) {
  Log log = read_log(path);
  std::string found, other;
  const Kind* chosen = nullptr;
  for (const Kind& k : kinds()) {
    if (!log.columns.contains(k.name)) continue;
    found += (found.empty() ? "" : ", ") + std::string(k.name);
    if (table == k.name || (table.empty() && log.columns.size() == 1)) chosen = &k;
  }
  for (const auto& [name, n] : log.others) other += (other.empty() ? "" : ", ") + name;
  if (chosen == nullptr)
    throw Error(
        ErrorKind::kInput,
        (table.empty() ? std::string("an NMEA log of several kinds of sentence; say table = \"…\"")
                       : "an NMEA log without '" + table + "'") +
            "; found: " + (found.empty() ? "none that is known" : found) +
            (other.empty() ? "" : " (and " + other + ", not read)"),
        path);
  TableConvention c = foreign_convention(Foreign::kNmea);
  c.section = chosen->section;
  c.columns["time"] = {"t_s"};
  if (c.section == "fix") c.columns["lat"] = {"lat_deg"}, c.columns["lon"] = {"lon_deg"};
  if (c.section == "heading") c.columns["heading"] = {"heading_deg"};
  if (chosen->header[3 % chosen->header.size()] == "h_m") c.columns["height"] = {"h_m"};
  std::map<std::string, std::string> meta;
  if (const auto n = log.damaged[chosen->name]; n > 0)
    meta["damaged_sentences"] = std::to_string(n);
  return std::make_unique<MemoryTable>(path, c, chosen->header,
                                       std::move(log.columns[chosen->name]), meta);
}

}  // namespace loxo
