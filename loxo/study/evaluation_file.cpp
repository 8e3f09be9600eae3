// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/evaluation_file.hpp"

#include "loxo/log/drive.hpp"
#include "loxo/log/solution_file.hpp"
#include "loxo/num/error.hpp"

namespace loxo {

Json to_json(const Evaluation& e) {
  Json json;
  for (const auto& v : evaluation_values(e)) {
    if (v.name == "epochs")
      json[v.name] = e.epochs;
    else
      json[v.name] = v.value;
  }
  json["nees_band"] = {e.nees_low, e.nees_high};
  Json table = Json::array();
  for (const auto& r : e.by_length) {
    table.push_back({{"length_m", r.length},
                     {"pct_50", r.pct_50},
                     {"pct_95", r.pct_95},
                     {"pct_max", r.pct_max},
                     {"pieces", r.pieces},
                     {"independent", r.independent}});
  }
  json["by_length"] = table;
  return json;
}

Solution read_truth(const std::string& path, Ellipsoid& ellipsoid, Diagnostics& diagnostics) {
  if (!is_drive(path)) return read_solution(path, ellipsoid, diagnostics);
  const Drive drive = read_drive(path);
  if (!drive.reference.present)
    throw Error(ErrorKind::kInput,
                "the drive has no [reference]: expected a truth file, or a drive that names one",
                path);
  ellipsoid = drive.ellipsoid;
  Solution truth = read_reference(drive, diagnostics);
  if (truth.rows.empty())
    throw Error(ErrorKind::kInput, "no row could be read", drive.reference.file);
  return truth;
}

}  // namespace loxo
