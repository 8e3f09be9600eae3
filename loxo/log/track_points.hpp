// SPDX-License-Identifier: Apache-2.0
// A recorded track as points: GPX, GeoJSON, or CSV, told apart by name.
#pragma once
#include <string>
#include <vector>

#include "loxo/ins/samples.hpp"

namespace loxo {

struct TrackPoint {
  double lat = 0, lon = 0, h = 0;  // rad, m
  double t = kNone;                // s from the first point, where the file has times
};
// .gpx: trkpt (or rtept, wpt where there is none) with ele and time; .geojson and .json: the first
// LineString, or the Points in order, with properties.t_s; .csv: lat_deg, lon_deg, and h_m, t_s
// where they are. Throws Error(kInput) naming file and place for what is none of these, a point out
// of range, fewer than two points.
std::vector<TrackPoint> read_track_points(const std::string& path);

}  // namespace loxo
