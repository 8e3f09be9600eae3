// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/trial.hpp"

#include "loxo/num/error.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo {
namespace {

using Maker = std::unique_ptr<TrialKind> (*)(const TomlTable&);
struct Entry {
  KindInfo info;
  Maker make;
};
const std::vector<Entry>& entries() {
  static const std::vector<Entry> list = {
      {{"two_point",
        "one straight drive between two surveyed points, calibrated by a two-point method"},
       make_two_point_trial},
      {{"drive", "a drive with sensor errors: simulated, navigated, dead-reckoned, evaluated"},
       make_drive_trial},
  };
  return list;
}

}  // namespace

const std::vector<KindInfo>& trial_kinds() {
  static const std::vector<KindInfo> list = [] {
    std::vector<KindInfo> l;
    for (const Entry& e : entries()) l.push_back(e.info);
    return l;
  }();
  return list;
}

std::unique_ptr<TrialKind> make_trial_kind(const std::string& kind, const TomlTable& settings,
                                           const std::string& where) {
  std::vector<std::string> names;
  for (const Entry& e : entries()) {
    if (e.info.name == kind) return e.make(settings);
    names.push_back(e.info.name);
  }
  throw Error(ErrorKind::kInput, "unknown kind of trial '" + kind + "'" + suggestion(kind, names),
              where);
}

}  // namespace loxo
