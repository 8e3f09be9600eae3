// SPDX-License-Identifier: Apache-2.0
#include "loxo/report/filter_section.hpp"

#include <gtest/gtest.h>

#include "loxo/report/json_sections.hpp"

namespace loxo::report {
namespace {

const char* kFilter = R"({"command": "navigate", "mode": "filter", "diverged": false,
  "alignment": {"method": "static", "heading_std_deg": 0.1},
  "constants": {"k": 1.02, "k_std": 1e-4, "eps_deg": 1.0, "eps_deg_std": 0.01},
  "innovations": {"odometer": {"used": 90, "deweighted": 5, "rejected": 5, "nis_mean": 4.0,
    "nis_low": 0.74, "nis_high": 1.3, "nis_above_95": 0.2, "lag_one": 0.0}},
  "innovation_history": {"t_s": [0, 10], "odometer": [1.0, null]},
  "segments": [{"begin_s": 0, "end_s": 5, "trusted": "standing", "why": "all agree", "radius_95_m": 0.5,
                "fixes": 5, "wheel_readings": 0, "wheel_left_out": 0},
               {"begin_s": 5, "end_s": 20, "trusted": "odometer", "why": "no fix", "radius_95_m": 1.2345,
                "fixes": 0, "wheel_readings": 15, "wheel_left_out": 2}],
  "history": [{"t_s": 0, "k": 1.0, "k_std": 0.03}, {"t_s": 10, "k": 1.02, "k_std": 1e-4}],
  "events": {"slip": 0}, "settings": {}, "diagnostics": []})";

TEST(FilterSection, SaysWhatWasTrustedAndHowTheInnovationsLie) {
  const Json j = parse_json(kFilter, "");
  ASSERT_TRUE(is_filter_result(j));
  EXPECT_FALSE(is_filter_result(parse_json(R"({"command": "navigate", "mode": "reckon"})", "")));
  const Section s = result_section(j, "drive");
  EXPECT_EQ(s.title, "Filter: drive");
  int tables = 0, series = 0;
  for (const Block& b : s.blocks) {
    if (const auto* t = std::get_if<Table>(&b)) {
      ++tables;
      if (t->title == "Innovations") {
        ASSERT_EQ(t->rows.size(), 1u);
        EXPECT_EQ(t->rows[0].cells.back().text, "wider than stated");
        EXPECT_EQ(t->rows[0].cells.back().verdict, Verdict::kBad);
      }
      if (t->title.starts_with("Which source")) {
        ASSERT_EQ(t->columns.size(), t->rows[1].cells.size());
        EXPECT_DOUBLE_EQ(t->rows[1].cells[6].value, 15);
        EXPECT_DOUBLE_EQ(t->rows[1].cells[7].value, 2);
        EXPECT_DOUBLE_EQ(t->rows[1].cells[8].value, 1.23);
      }
      if (t->title == "Constants at the end") {
        EXPECT_EQ(t->rows[1].cells[1].value, 1.0);
        EXPECT_EQ(t->rows[1].cells[1].error, 0.01);
        EXPECT_EQ(t->rows.size(), 2u);
      }
    }
    if (const auto* f = std::get_if<Series>(&b)) {
      ++series;
      if (f->title == "Odometer scale") {
        EXPECT_DOUBLE_EQ(f->curves[0].hi[0], 1.06);
        // What the end knows, 1.02 -+ 2e-4, as wide again on either side.
        EXPECT_NEAR(f->y.lo, 1.0194, 1e-12);
        EXPECT_NEAR(f->y.hi, 1.0206, 1e-12);
        EXPECT_NE(f->caption.find("0.06"), std::string::npos) << f->caption;
        ASSERT_EQ(f->spans.size(), 1u);
        EXPECT_EQ(f->spans[0].label, "standing");
      }
    }
  }
  EXPECT_EQ(tables, 3);
  EXPECT_EQ(series, 2);  // k with its band, and the innovations; what has no band is not drawn
}

}  // namespace
}  // namespace loxo::report
