// SPDX-License-Identifier: Apache-2.0
// An Evaluation as JSON: the keys of interface.md ("loxo evaluate --json") and the tables.
#pragma once
#include "loxo/study/evaluate.hpp"
#include "loxo/text/json.hpp"

namespace loxo {

Json to_json(const Evaluation& evaluation);

// What FILE of `--truth FILE` holds: a solution-like table, or a drive (folder, .toml, .h5) whose
// [reference] is meant. Throws Error(kInput) when there is no reference. `ellipsoid`: replaced by
// the drive's.
Solution read_truth(const std::string& path, Ellipsoid& ellipsoid, Diagnostics& diagnostics);

}  // namespace loxo
