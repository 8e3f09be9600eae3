// SPDX-License-Identifier: Apache-2.0
// The scenarios that come with the program. Written by tools/embed_campaigns from
// examples/scenarios/; a test compares.
#include "loxo/study/scenario.hpp"

namespace loxo {

const std::vector<ReadyScenario>& ready_scenarios() {
  static const std::vector<ReadyScenario> list = {
#include "loxo/study/ready_scenarios.inc"
  };
  return list;
}

}  // namespace loxo
