// SPDX-License-Identifier: Apache-2.0
#include "loxo/report/coast.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "loxo/report/web_bundle.hpp"

namespace loxo::report {
namespace {

using Unit = std::array<double, 3>;

Unit unit_of(double lat, double lon) {
  return {std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat)};
}
double chord(const Unit& a, const Unit& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

// The bundle holds each polygon as count of rings, each ring as count of points, then differences
// of longitude and latitude, zigzag, seven bits a byte.
class Reader {
 public:
  bool at_end() const { return at_ >= kWebCoastSize; }
  int next() {
    std::uint32_t value = 0;
    for (int shift = 0; at_ < kWebCoastSize; shift += 7) {
      const auto byte = static_cast<unsigned char>(kWebCoast[at_++]);
      value |= static_cast<std::uint32_t>(byte & 0x7f) << shift;
      if (!(byte & 0x80)) break;
    }
    return static_cast<int>(value >> 1) ^ -static_cast<int>(value & 1);
  }

 private:
  std::size_t at_ = 0;
};

}  // namespace

Polygons coast_about(std::span<const double> lat, std::span<const double> lon) {
  std::vector<Unit> track;
  Unit centre{0, 0, 0};
  const std::size_t n = std::min(lat.size(), lon.size()), stride = 1 + n / 4000;
  for (std::size_t i = 0; i < n; i += stride) {
    if (!std::isfinite(lat[i]) || !std::isfinite(lon[i])) continue;
    track.push_back(unit_of(lat[i], lon[i]));
    for (int k = 0; k < 3; ++k) centre[k] += track.back()[k];
  }
  const double size = std::hypot(centre[0], centre[1], centre[2]);
  if (!(size > 0)) return {};
  for (double& c : centre) c /= size;
  double reach = 0;
  for (const auto& p : track) reach = std::max(reach, chord(p, centre));
  constexpr double kEarth = 6371e3;
  if (reach * kEarth < 50e3 || reach * kEarth > 4000e3) return {};
  const double fine = 3.0 * reach + 200e3 / kEarth;  // what a wide map shows of it

  constexpr double kHundredth = std::numbers::pi / 18000;
  constexpr std::size_t kCoarse = 16;
  Polygons polygons;
  for (Reader in; !in.at_end();) {
    std::vector<std::vector<int>> rings;
    bool land_kept = false;
    const int count_of_rings = in.next();
    for (int r = 0; r < count_of_rings; ++r) {
      const auto count = static_cast<std::size_t>(in.next());
      std::vector<std::array<int, 2>> kept;
      bool near = false;
      int x = 0, y = 0, before[2] = {0, 0};
      double area = 0;
      for (std::size_t i = 0; i < count; ++i) {
        x += in.next();
        y += in.next();
        area += i ? 1.0 * before[0] * y - 1.0 * x * before[1] : 0.0;
        before[0] = x;
        before[1] = y;
        const bool inside = chord(unit_of(y * kHundredth, x * kHundredth), centre) < fine;
        near = near || inside;
        if (inside || i % kCoarse == 0 || i + 1 == count) kept.push_back({x, y});
      }
      if (!near && count < 6 * kCoarse) continue;  // an island or a lake elsewhere
      // Thinned, a thin ring may turn over, and would then be all of the Earth but itself.
      double thinned = 0;
      for (std::size_t i = 1; i < kept.size(); ++i)
        thinned += 1.0 * kept[i - 1][0] * kept[i][1] - 1.0 * kept[i][0] * kept[i - 1][1];
      if (kept.size() < 4 || area * thinned <= 0) continue;
      land_kept = land_kept || r == 0;
      std::vector<int> ring;
      ring.reserve(2 * kept.size());
      before[0] = before[1] = 0;
      for (const auto& p : kept)
        for (int k = 0; k < 2; ++k) {
          ring.push_back(p[k] - before[k]);
          before[k] = p[k];
        }
      rings.push_back(std::move(ring));
    }
    if (land_kept) polygons.push_back(std::move(rings));
  }
  return polygons;
}

}  // namespace loxo::report
