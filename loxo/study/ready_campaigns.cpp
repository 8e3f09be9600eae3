// SPDX-License-Identifier: Apache-2.0
// The campaigns that come with the program. Written by tools/embed_campaigns from
// examples/campaigns/; a test compares.
#include "loxo/study/campaign.hpp"

namespace loxo {

const std::vector<ReadyCampaign>& ready_campaigns() {
  static const std::vector<ReadyCampaign> list = {
#include "loxo/study/ready_campaigns.inc"
  };
  return list;
}

}  // namespace loxo
