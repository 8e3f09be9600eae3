// SPDX-License-Identifier: Apache-2.0
// Coastlines for one map: fine (Natural Earth 1:50m) about the track, coarse elsewhere, so that a
// page stays small.
#pragma once
#include <span>
#include <vector>

namespace loxo::report {

// Polygons of rings (land, then its lakes), a ring as [lon, lat, dlon, dlat, …] in hundredths of a
// degree.
using Polygons = std::vector<std::vector<std::vector<int>>>;
// Empty where the front end's own
// coarse coast (1:110m) does: tracks [rad] within 50 km (drawn on a plane) or over more than 4000
// km.
Polygons coast_about(std::span<const double> lat, std::span<const double> lon);

}  // namespace loxo::report
