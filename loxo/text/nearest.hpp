// SPDX-License-Identifier: Apache-2.0
// "Did you mean": the nearest of a list of names.
#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace loxo {

// The nearest candidate by edit distance (case-insensitive), or "" if none is near (more than half
// differs).
std::string nearest(std::string_view name, std::span<const std::string> candidates);
// "; did you mean 'X'?" or, with nothing near, "; valid: a, b, c" (at most 12 named).
std::string suggestion(std::string_view name, std::span<const std::string> candidates);

}  // namespace loxo
