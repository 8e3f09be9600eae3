// SPDX-License-Identifier: Apache-2.0
// Tracks of positions: GPX and GeoJSON. Time is seconds from the first point, whose own time is in
// the meta; a track without times has its points one second apart, and says so.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "loxo/log/foreign.hpp"
#include "loxo/num/error.hpp"
#include "loxo/text/gzip.hpp"
#include "loxo/text/json.hpp"

namespace loxo {
namespace {

// Days from 1970-01-01 in the Gregorian calendar.
long days(int y, int m, int d) {
  y -= m <= 2 ? 1 : 0;
  const int era = (y >= 0 ? y : y - 399) / 400, yoe = y - era * 400;
  const int doy = (153 * (m + (m > 2 ? -3 : 9)) + 2) / 5 + d - 1;
  return era * 146097L + yoe * 365 + yoe / 4 - yoe / 100 + doy - 719468L;
}
// 2014-08-01T00:00:00.3Z or with +02:00; nan for anything else.
double seconds_of(const std::string& s) {
  int y = 0, mo = 0, d = 0, h = 0, mi = 0, n = 0;
  double sec = 0;
  if (std::sscanf(s.c_str(), "%4d-%2d-%2dT%2d:%2d:%lf%n", &y, &mo, &d, &h, &mi, &sec, &n) != 6 ||
      mo < 1 || mo > 12 || d < 1 || d > 31)
    return std::nan("");
  int zh = 0, zm = 0;
  double zone = 0;
  const std::string rest = s.substr(static_cast<std::size_t>(n));
  if (rest.size() > 1 && (rest[0] == '+' || rest[0] == '-') &&
      std::sscanf(rest.c_str() + 1, "%2d:%2d", &zh, &zm) >= 1)
    zone = (rest[0] == '-' ? -1 : 1) * (3600.0 * zh + 60.0 * zm);
  return 86400.0 * static_cast<double>(days(y, mo, d)) + 3600.0 * h + 60.0 * mi + sec - zone;
}

struct Track {
  std::vector<double> t, lat, lon, h;
  std::string begin;  // text of the first time
  void add(double lat_deg, double lon_deg, double h_m, const std::string& time) {
    if (t.empty()) begin = time;
    t.push_back(seconds_of(time));
    lat.push_back(lat_deg);
    lon.push_back(lon_deg);
    h.push_back(h_m);
  }
};

std::unique_ptr<Table> table_of(const std::string& path, Foreign format, Track track) {
  if (track.t.empty()) throw Error(ErrorKind::kInput, "a track without points", path);
  std::map<std::string, std::string> meta;
  const double first = track.t[0];
  if (std::isnan(first)) {
    meta["time"] = "none in the file: points one second apart";
    for (std::size_t i = 0; i < track.t.size(); ++i) track.t[i] = static_cast<double>(i);
  } else {
    meta["time_of_first"] = track.begin;
    for (double& t : track.t) t -= first;
  }
  return std::make_unique<MemoryTable>(
      path, foreign_convention(format),
      std::vector<std::string>{"t_s", "lat_deg", "lon_deg", "h_m"},
      std::vector<std::vector<double>>{track.t, track.lat, track.lon, track.h}, meta);
}

// Value of an attribute in a tag, nan if there is none.
double attribute(std::string_view tag, const std::string& name) {
  for (std::size_t at = 0; (at = tag.find(name, at)) != std::string_view::npos; ++at) {
    const char before = at > 0 ? tag[at - 1] : ' ';
    std::size_t p = at + name.size();
    while (p < tag.size() && tag[p] == ' ') ++p;
    if ((before != ' ' && before != '\t' && before != '\n' && before != '\r') || p >= tag.size() ||
        tag[p] != '=')
      continue;
    ++p;
    while (p < tag.size() && tag[p] == ' ') ++p;
    if (p >= tag.size() || (tag[p] != '"' && tag[p] != '\'')) continue;
    const auto end = tag.find(tag[p], p + 1);
    if (end == std::string_view::npos) return std::nan("");
    const std::string text(tag.substr(p + 1, end - p - 1));
    char* stop = nullptr;
    const double x = std::strtod(text.c_str(), &stop);
    return text.empty() || *stop != '\0' ? std::nan("") : x;
  }
  return std::nan("");
}
std::string element(std::string_view body, const std::string& name) {
  const auto open = body.find("<" + name + ">");
  if (open == std::string_view::npos) return {};
  const auto from = open + name.size() + 2, to = body.find("</" + name, from);
  return to == std::string_view::npos ? std::string() : std::string(body.substr(from, to - from));
}

void geometry(const Json& g, const Json& times, Track& track, const std::string& path, int depth) {
  const auto refuse = [&](const std::string& what) { throw Error(ErrorKind::kInput, what, path); };
  if (depth > 8 || !g.is_object() || !g.contains("type") || !g["type"].is_string()) return;
  const std::string type = g["type"];
  if (type == "FeatureCollection" || type == "GeometryCollection") {
    const char* key = type == "FeatureCollection" ? "features" : "geometries";
    if (g.contains(key) && g[key].is_array())
      for (const Json& f : g[key]) geometry(f, times, track, path, depth + 1);
    return;
  }
  if (type == "Feature") {
    Json own;
    if (g.contains("properties") && g["properties"].is_object()) {
      const Json& p = g["properties"];
      for (const char* key : {"coordTimes", "times", "time", "timestamp"})
        if (own.is_null() && p.contains(key)) own = p[key];
      if (own.is_null() && p.contains("coordinateProperties") &&
          p["coordinateProperties"].is_object() && p["coordinateProperties"].contains("times"))
        own = p["coordinateProperties"]["times"];
    }
    if (g.contains("geometry")) geometry(g["geometry"], own, track, path, depth + 1);
    return;
  }
  if (!g.contains("coordinates") || !g["coordinates"].is_array()) return;
  const auto point = [&](const Json& c, const Json& time) {
    if (!c.is_array() || c.size() < 2 || !c[0].is_number() || !c[1].is_number())
      refuse("expected a position [longitude, latitude], found " + c.dump().substr(0, 60));
    track.add(c[1], c[0], c.size() > 2 && c[2].is_number() ? c[2].get<double>() : std::nan(""),
              time.is_string() ? time.get<std::string>() : "");
  };
  const auto line = [&](const Json& cs, const Json& ts) {
    for (std::size_t i = 0; i < cs.size(); ++i)
      point(cs[i], ts.is_array() && i < ts.size() ? ts[i] : Json());
  };
  const Json& c = g["coordinates"];
  if (type == "Point") {
    point(c, times);
  } else if (type == "LineString" || type == "MultiPoint") {
    line(c, times);
  } else if (type == "MultiLineString") {
    for (std::size_t i = 0; i < c.size(); ++i)
      line(c[i], times.is_array() && i < times.size() ? times[i] : Json());
  }
}

}  // namespace

std::unique_ptr<Table> open_gpx(const std::string& path) {
  const std::string text = read_file(path);
  Track track;
  // The points of tracks, else those of a route, else way points.
  for (const std::string tag : {"trkpt", "rtept", "wpt"}) {
    for (std::size_t at = 0; (at = text.find("<" + tag, at)) != std::string::npos;) {
      const auto close = text.find('>', at);
      if (close == std::string::npos) break;
      const std::string_view head(text.data() + at, close - at);
      std::string_view body;
      if (head.back() != '/') {
        const auto end = text.find("</" + tag, close);
        if (end == std::string::npos) break;
        body = {text.data() + close + 1, end - close - 1};
      }
      const std::string height = element(body, "ele");
      track.add(attribute(head, "lat"), attribute(head, "lon"),
                height.empty() ? std::nan("") : std::strtod(height.c_str(), nullptr),
                element(body, "time"));
      at = close;
    }
    if (!track.t.empty()) break;
  }
  return table_of(path, Foreign::kGpx, std::move(track));
}

std::unique_ptr<Table> open_geojson(const std::string& path) {
  Track track;
  geometry(parse_json(read_file(path), path), Json(), track, path, 0);
  return table_of(path, Foreign::kGeoJson, std::move(track));
}

}  // namespace loxo
