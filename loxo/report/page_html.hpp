// SPDX-License-Identifier: Apache-2.0
// A Page as one self-contained HTML file: no network, below kMaxBytes whatever the length of its
// vectors.
#pragma once
#include <cstddef>
#include <string>

#include "loxo/report/page.hpp"

namespace loxo::report {

inline constexpr std::size_t kMaxBytes = 2'000'000;

// The data of a page. `points`: at most about this many points are kept of a curve, track or cloud,
// and of a table at most this many rows. Deterministic; safe inside a <script> element.
std::string to_json(const Page& page, std::size_t points = 2000);
// The whole file; fewer points are kept until it is below kMaxBytes. Throws Error(kWork) if even
// that fails.
std::string to_html(const Page& page);
// Written aside, then renamed; "-" is standard output.
void write_page(const Page& page, const std::string& path);

// "1.23456 ± 0.00012": two digits of the error; without an error `digits` significant digits. "–"
// for NaN.
std::string format_number(double value, double error = kNoValue, int digits = 6);

}  // namespace loxo::report
