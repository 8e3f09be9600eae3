// SPDX-License-Identifier: Apache-2.0
#include "loxo/log/track_points.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string_view>

#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/csv.hpp"
#include "loxo/text/gzip.hpp"
#include "loxo/text/json.hpp"

namespace loxo {
namespace {

[[noreturn]] void refuse(const std::string& what, const std::string& where) {
  throw Error(ErrorKind::kInput, what, where);
}

TrackPoint point(double lat_deg, double lon_deg, double h, double t, const std::string& where) {
  if (!(std::fabs(lat_deg) <= 90 && std::fabs(lon_deg) <= 360))
    refuse("expected a latitude in [-90, 90] and a longitude in [-360, 360], found " +
               std::to_string(lat_deg) + ", " + std::to_string(lon_deg),
           where);
  return {lat_deg * deg, std::remainder(lon_deg, 360.0) * deg, std::isfinite(h) ? h : 0.0, t};
}

std::optional<double> number_in(std::string_view text) {
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front())))
    text.remove_prefix(1);
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())))
    text.remove_suffix(1);
  double x = 0;
  const auto end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, x);
  if (error != std::errc() || stop != end) return std::nullopt;
  return x;
}

// "2026-05-01T12:00:03.25Z" to seconds since 1970; an offset "+02:00" is taken out.
std::optional<double> seconds_of(const std::string& text) {
  int y = 0, mo = 0, d = 0, h = 0, mi = 0, used = 0;
  double s = 0;
  if (std::sscanf(text.c_str(), " %d-%d-%dT%d:%d:%lf%n", &y, &mo, &d, &h, &mi, &s, &used) != 6)
    return std::nullopt;
  int off_h = 0, off_m = 0;
  const char sign =
      used < static_cast<int>(text.size()) ? text[static_cast<std::size_t>(used)] : 'Z';
  if ((sign == '+' || sign == '-') &&
      std::sscanf(text.c_str() + used + 1, "%d:%d", &off_h, &off_m) < 1)
    return std::nullopt;
  // Days of the proleptic Gregorian calendar.
  const int a = (14 - mo) / 12, years = y + 4800 - a, months = mo + 12 * a - 3;
  const long long days = d + (153LL * months + 2) / 5 + 365LL * years + years / 4 - years / 100 +
                         years / 400 - 32045 - 2440588;
  const double local = static_cast<double>(days) * 86400.0 + h * 3600.0 + mi * 60.0 + s;
  return local - (sign == '-' ? -1.0 : 1.0) * (off_h * 3600.0 + off_m * 60.0);
}

std::string line_of(const std::string& path, const std::string& text, std::size_t at) {
  return path + ":" +
         std::to_string(1 + std::count(text.begin(), text.begin() + static_cast<long>(at), '\n'));
}

// What stands between <name> and </name> after `from`, before `to`.
std::optional<std::string> element(const std::string& text, const std::string& name,
                                   std::size_t from, std::size_t to) {
  const auto open = text.find("<" + name + ">", from);
  if (open == std::string::npos || open >= to) return std::nullopt;
  const auto begin = open + name.size() + 2, end = text.find("</", begin);
  if (end == std::string::npos) return std::nullopt;
  return text.substr(begin, end - begin);
}
std::optional<double> attribute(const std::string& tag, const std::string& name) {
  for (auto at = tag.find(name); at != std::string::npos; at = tag.find(name, at + 1)) {
    auto next = at + name.size();
    if (at == 0 || !std::isspace(static_cast<unsigned char>(tag[at - 1]))) continue;
    while (next < tag.size() && std::isspace(static_cast<unsigned char>(tag[next]))) ++next;
    if (next >= tag.size() || tag[next] != '=') continue;
    const auto quote = tag.find_first_of("\"'", next);
    if (quote == std::string::npos) return std::nullopt;
    const auto end = tag.find(tag[quote], quote + 1);
    if (end == std::string::npos) return std::nullopt;
    return number_in(std::string_view(tag).substr(quote + 1, end - quote - 1));
  }
  return std::nullopt;
}

std::vector<TrackPoint> read_gpx(const std::string& path) {
  const std::string text = read_file(path);
  if (text.find("<gpx") == std::string::npos) refuse("expected a GPX file, found no <gpx>", path);
  std::vector<TrackPoint> points;
  for (const std::string kind : {"trkpt", "rtept", "wpt"}) {
    std::size_t at = 0;
    while ((at = text.find("<" + kind, at)) != std::string::npos) {
      const auto where = line_of(path, text, at);
      const auto close = text.find('>', at);
      if (close == std::string::npos) refuse("<" + kind + " is not closed", where);
      const std::string tag = text.substr(at, close - at);
      const auto lat = attribute(tag, "lat"), lon = attribute(tag, "lon");
      if (!lat || !lon)
        refuse("expected lat and lon, numbers in degrees, in <" + kind + ">", where);
      auto end = close;
      if (tag.back() != '/') {
        end = text.find("</" + kind, close);
        if (end == std::string::npos) refuse("<" + kind + "> is not closed", where);
      }
      double h = 0, t = kNone;
      if (const auto ele = element(text, "ele", close, end)) {
        const auto x = number_in(*ele);
        if (!x) refuse("expected metres in <ele>, found '" + *ele + "'", where);
        h = *x;
      }
      if (const auto time = element(text, "time", close, end)) {
        const auto x = seconds_of(*time);
        if (!x) refuse("expected a time as 2026-05-01T12:00:00Z, found '" + *time + "'", where);
        t = *x;
      }
      points.push_back(point(*lat, *lon, h, t, where));
      at = end;
    }
    if (!points.empty()) break;
  }
  return points;
}

std::vector<TrackPoint> read_geojson(const std::string& path) {
  const Json json = read_json(path);
  std::vector<TrackPoint> points;
  const auto add = [&](const Json& c, double t) {
    if (!c.is_array() || c.size() < 2 || !c[0].is_number() || !c[1].is_number())
      refuse("expected [longitude, latitude] or [longitude, latitude, height], found " + c.dump(),
             path);
    const double h = c.size() > 2 && c[2].is_number() ? c[2].get<double>() : 0.0;
    points.push_back(point(c[1].get<double>(), c[0].get<double>(), h, t, path));
  };
  bool line = false;
  const auto geometry = [&](const Json& g, const Json& properties) {
    if (!g.is_object() || line) return;
    const std::string type = g.value("type", "");
    const Json c = g.value("coordinates", Json::array());
    if (type == "LineString") {
      points.clear();
      for (const auto& p : c) add(p, kNone);
      line = true;
    } else if (type == "MultiLineString") {
      points.clear();
      for (const auto& part : c)
        for (const auto& p : part) add(p, kNone);
      line = true;
    } else if (type == "Point") {
      const bool timed =
          properties.is_object() && properties.contains("t_s") && properties.at("t_s").is_number();
      add(c, timed ? properties.at("t_s").get<double>() : kNone);
    }
  };
  if (!json.is_object()) refuse("expected a GeoJSON object", path);
  const std::string type = json.value("type", "");
  if (type == "FeatureCollection") {
    for (const auto& f : json.value("features", Json::array()))
      if (f.is_object())
        geometry(f.value("geometry", Json()), f.value("properties", Json::object()));
  } else if (type == "Feature") {
    geometry(json.value("geometry", Json()), json.value("properties", Json::object()));
  } else {
    geometry(json, Json::object());
  }
  return points;
}

std::vector<TrackPoint> read_csv(const std::string& path) {
  CsvReader csv(path);
  std::vector<std::string> columns{"lat_deg", "lon_deg"};
  const bool h = csv.has("h_m"), t = csv.has("t_s");
  if (h) columns.emplace_back("h_m");
  if (t) columns.emplace_back("t_s");
  for (const auto& c : columns) csv.index(c);
  csv.select(columns);
  std::vector<double> row(columns.size());
  std::vector<TrackPoint> points;
  Diagnostics diagnostics;
  while (csv.next(row, diagnostics)) {
    const auto where = path + ":" + std::to_string(csv.line());
    points.push_back(point(row[0], row[1], h ? row[2] : 0.0, t ? row.back() : kNone, where));
  }
  return points;
}

}  // namespace

std::vector<TrackPoint> read_track_points(const std::string& path) {
  std::string name = std::filesystem::path(path).filename().string();
  if (name.size() > 3 && name.substr(name.size() - 3) == ".gz") name.resize(name.size() - 3);
  const std::string kind = std::filesystem::path(name).extension().string();
  if (!std::filesystem::exists(path)) refuse("no such file", path);
  std::vector<TrackPoint> points;
  if (kind == ".gpx")
    points = read_gpx(path);
  else if (kind == ".geojson" || kind == ".json")
    points = read_geojson(path);
  else if (kind == ".csv")
    points = read_csv(path);
  else
    refuse("expected a track as .gpx, .geojson or .csv, found '" + kind + "'", path);
  if (points.size() < 2)
    refuse("expected a track of two points or more, found " + std::to_string(points.size()), path);
  const double t0 = points.front().t;
  for (auto& p : points) p.t -= t0;
  return points;
}

}  // namespace loxo
