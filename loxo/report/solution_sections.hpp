// SPDX-License-Identifier: Apache-2.0
// Sections of a page about solutions: where they went, how they moved, how wrong they were.
#pragma once
#include <string>
#include <vector>

#include "loxo/ins/solution.hpp"
#include "loxo/report/page.hpp"

namespace loxo::report {

struct NamedSolution {
  std::string name;
  const Solution* solution = nullptr;
  bool truth = false;
};

// What the figures of one page share: times are shown since `t0` (0 where the clock starts near
// zero).
double time_origin(const std::vector<NamedSolution>& solutions);

// The map: all tracks, the surveyed points, start and end of the first track.
Section map_section(const std::vector<NamedSolution>& solutions,
                    const std::vector<MapPoint>& points);
// Position, velocity and attitude over time; stretches of one navigation frame are shaded, health
// is told in words.
Section motion_section(const std::vector<NamedSolution>& solutions);

}  // namespace loxo::report
