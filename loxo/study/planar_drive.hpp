// SPDX-License-Identifier: Apache-2.0
// A drive without an inertial unit through the filter and the smoother: its track, corrected by
// fixes and benchmarks.
#pragma once
#include "loxo/study/filter_drive.hpp"

namespace loxo {

// As filter_drive, whose options it shares. Throws Error(kInput) where there is no track, no start;
// Error(kWork) where nothing tells the heading.
FilterResult planar_drive(const Drive& drive, const FilterOptions& options, const RowSink& sink,
                          Diagnostics& diagnostics);

}  // namespace loxo
