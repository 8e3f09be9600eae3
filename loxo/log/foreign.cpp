// SPDX-License-Identifier: Apache-2.0
#include "loxo/log/foreign.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include "loxo/num/error.hpp"
#include "loxo/text/gzip.hpp"

namespace loxo {
namespace {

// Numbers between blanks on one line; empty if anything else is there.
std::vector<double> numbers_of(std::string_view line) {
  std::vector<double> out;
  const char *p = line.data(), *const end = p + line.size();
  for (;;) {
    while (p < end && (*p == ' ' || *p == '\t' || *p == '\r')) ++p;
    if (p == end) return out;
    if (*p == '+') ++p;
    double x = 0;
    const auto [q, error] = std::from_chars(p, end, x);
    if (error != std::errc() || (q < end && *q != ' ' && *q != '\t' && *q != '\r')) return {};
    out.push_back(x);
    p = q;
  }
}

std::optional<Foreign> by_numbers(std::string_view head, bool whole) {
  std::vector<std::vector<double>> rows;
  while (!head.empty() && rows.size() < 32) {
    const auto end = head.find('\n');
    if (end == std::string_view::npos && !whole) break;
    const std::string_view line = head.substr(0, end);
    head.remove_prefix(end == std::string_view::npos ? head.size() : end + 1);
    if (line.find_first_not_of(" \t\r") == std::string_view::npos) continue;
    if (line[0] == '#' || line[0] == '%') continue;
    rows.push_back(numbers_of(line));
    if (rows.back().size() < 2 || rows.back().size() != rows[0].size()) return std::nullopt;
  }
  if (rows.empty()) return std::nullopt;
  const auto all = [&](auto&& f) { return std::all_of(rows.begin(), rows.end(), f); };
  const auto place = [](double lat, double lon) {
    return std::fabs(lat) <= 90 && std::fabs(lon) <= 180;
  };
  switch (rows[0].size()) {
    case 7: {
      // A rate above 5 Hz and increments below half a radian are an IMU's.
      const double step = rows.size() > 1
                              ? (rows.back()[0] - rows[0][0]) / static_cast<double>(rows.size() - 1)
                              : 1.0;
      if (step > 0 && step < 0.2 && all([](const auto& r) {
            return std::fabs(r[1]) < 0.5 && std::fabs(r[2]) < 0.5 && std::fabs(r[3]) < 0.5;
          }))
        return Foreign::kKfGinsImu;
      if (all([&](const auto& r) {
            return place(r[1], r[2]) && r[4] > 0 && r[5] > 0 && r[6] > 0 && r[4] < 1e4;
          }))
        return Foreign::kKfGinsGnss;
      break;
    }
    case 13:
      if (all([&](const auto& r) { return place(r[1], r[2]) && r[4] > 0 && r[10] > 0; }))
        return Foreign::kKfGinsGnssV;
      break;
    case 11:
      if (all([&](const auto& r) {
            return place(r[2], r[3]) && std::fabs(r[8]) <= 180 && std::fabs(r[9]) <= 90 &&
                   std::fabs(r[10]) <= 360 && r[0] >= 0 && r[0] == std::floor(r[0]);
          }))
        return Foreign::kKfGinsNav;
      break;
    default:
      break;
  }
  return Foreign::kPlainText;
}

}  // namespace

std::optional<Foreign> foreign_format(const std::string& path) {
  if (path == "-") return std::nullopt;
  std::string head(8192, '\0');
  bool whole = false;
  try {
    ByteSource source(path);
    std::size_t n = 0;
    while (n < head.size()) {
      const std::size_t got = source.read(head.data() + n, head.size() - n);
      if (got == 0) break;
      n += got;
    }
    whole = n < head.size();
    head.resize(n);
  } catch (const Error&) {
    return std::nullopt;
  }
  if (head.starts_with("$IMURAW")) return Foreign::kImr;
  if (head.find('\0') != std::string::npos) return std::nullopt;
  std::string_view text = head;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  if (text.starts_with("% PSINS")) return Foreign::kPsinsImu;
  const auto first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return std::nullopt;
  text.remove_prefix(first);
  if (text[0] == '<')
    return text.find("<gpx") != std::string_view::npos ? std::optional(Foreign::kGpx)
                                                       : std::nullopt;
  if (text[0] == '{')
    return text.find("\"type\"") != std::string_view::npos ? std::optional(Foreign::kGeoJson)
                                                           : std::nullopt;
  // A sentence begins its line, or stands behind a log's time: $ttsss,
  const std::string_view line = text.substr(0, text.find('\n'));
  const auto dollar = line.find('$');
  if (dollar != std::string_view::npos && dollar < 40 && line.size() > dollar + 6 &&
      std::all_of(line.begin() + static_cast<std::ptrdiff_t>(dollar) + 1,
                  line.begin() + static_cast<std::ptrdiff_t>(dollar) + 6,
                  [](char c) { return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'); }) &&
      line.substr(0, dollar).find(',') == std::string_view::npos)
    return Foreign::kNmea;
  return by_numbers(text, whole);
}

TableConvention foreign_convention(Foreign format) {
  using Columns = std::map<std::string, std::vector<std::string>>;
  const Columns increments{{"time", {"t_s"}},
                           {"gyro", {"dthx_rad", "dthy_rad", "dthz_rad"}},
                           {"accel", {"dvx_mps", "dvy_mps", "dvz_mps"}}};
  const Columns places{
      {"time", {"t_s"}}, {"lat", {"lat_deg"}}, {"lon", {"lon_deg"}}, {"height", {"h_m"}}};
  const auto with = [](Columns columns, const Columns& more) {
    columns.insert(more.begin(), more.end());
    return columns;
  };
  TableConvention c;
  switch (format) {
    case Foreign::kKfGinsImu:
      c = {"KF-GINS IMU text", "imu", "increment", "end", "FRD", increments};
      break;
    case Foreign::kKfGinsGnss:
    case Foreign::kKfGinsGnssV:
      c = {"KF-GINS GNSS text",
           "fix",
           "",
           "",
           "",
           with(places, {{"std_e", {"std_e_m"}}, {"std_n", {"std_n_m"}}, {"std_u", {"std_u_m"}}})};
      if (format == Foreign::kKfGinsGnssV) {
        c.columns["ve"] = {"ve_mps"};
        c.columns["vn"] = {"vn_mps"};
        c.columns["vu"] = {"vu_mps"};
        c.columns["std_v"] = {"std_vn_mps"};
      }
      break;
    case Foreign::kKfGinsNav:
      c = {"KF-GINS navigation text",
           "reference",
           "",
           "",
           "",
           with(places, {{"ve", {"ve_mps"}},
                         {"vn", {"vn_mps"}},
                         {"vu", {"vu_mps"}},
                         {"roll", {"roll_deg"}},
                         {"pitch", {"pitch_deg"}},
                         {"heading", {"heading_deg"}}})};
      break;
    case Foreign::kPlainText:
      c.format = "text of numbers without a header";
      break;
    case Foreign::kPsinsImu:
      c = {"PSINS .imu", "imu", "increment", "end", "RFU", increments};
      break;
    case Foreign::kImr:
      c = {"Waypoint .imr", "imu", "", "end", "RFU", {}};  // the rest is in the header
      break;
    case Foreign::kGpx:
    case Foreign::kGeoJson:
      c = {format == Foreign::kGpx ? "GPX" : "GeoJSON", "fix", "", "", "", places};
      break;
    case Foreign::kNmea:
      c.format = "NMEA 0183";
      break;
  }
  return c;
}

std::unique_ptr<Table> open_foreign(const std::string& path, Foreign format,
                                    const std::string& table) {
  if (format == Foreign::kNmea) return open_nmea(path, table);
  if (!table.empty())
    throw Error(ErrorKind::kInput, "a file of this format is one table; it has no '" + table + "'",
                path);
  switch (format) {
    case Foreign::kImr:
      return open_imr(path);
    case Foreign::kGpx:
      return open_gpx(path);
    case Foreign::kGeoJson:
      return open_geojson(path);
    default:
      return open_plain_text(path, format);
  }
}

}  // namespace loxo
