// SPDX-License-Identifier: Apache-2.0
#include "loxo/report/json_sections.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace loxo::report {
namespace {

template <typename T>
std::vector<const T*> blocks_of(const Section& section) {
  std::vector<const T*> out;
  for (const auto& b : section.blocks)
    if (const T* p = std::get_if<T>(&b)) out.push_back(p);
  return out;
}

const char* kCalibrate =
    R"({ "command": "calibrate", "recommended": "replay", "heading_model": "independent",
  "methods": { "rhumb": { "k": 1.21, "k_std": 1e-3, "eps_deg": 1.1, "eps_std_deg": 0.02, "correlation": 0.01, "closure_m": 0.3, "valid": true, "why": "" },
               "replay": { "k": 1.2, "k_std": 1e-5, "eps_deg": 1.0, "eps_std_deg": 0.002, "correlation": 0.01, "closure_m": 0.03, "valid": true, "why": "whole log" },
               "gauss": { "k": null, "eps_deg": null, "valid": false, "why": "the chord is zero" } },
  "chord_m": 1000, "route_m": 1234.5, "metres_per_pulse": 0.01025,
  "diagnostics": [ { "severity": "warning", "kind": "gap", "where": "odometer.csv:17", "what": "0.4 s without a row", "count": 3 } ] })";

TEST(ColumnOfKey, UnitsFromTheSuffix) {
  EXPECT_EQ(column_of_key("horizontal_rms_m").title, "horizontal rms");
  EXPECT_EQ(column_of_key("horizontal_rms_m").unit, "m");
  EXPECT_EQ(column_of_key("heading_drift_deg_h").unit, "deg/h");
  EXPECT_EQ(column_of_key("angle_random_walk_deg_sqrt_h").unit, "deg/√h");
  EXPECT_EQ(column_of_key("horizontal_pct_95").unit, "% of distance");
  EXPECT_EQ(column_of_key("epochs").unit, "");
}

TEST(KindOf, CommandOrKeys) {
  EXPECT_EQ(kind_of(parse_json(kCalibrate, "")), ResultKind::kCalibrate);
  EXPECT_EQ(kind_of(parse_json(R"({"horizontal_rms_m": 1})", "")), ResultKind::kEvaluate);
  EXPECT_EQ(kind_of(parse_json(R"([{"id": "a", "printed": 1}])", "")), ResultKind::kReproduce);
  EXPECT_EQ(kind_of(parse_json(R"({"command": "something new"})", "")), ResultKind::kOther);
  EXPECT_EQ(kind_of(parse_json(R"({"a": 1})", "")), ResultKind::kUnknown);
  EXPECT_EQ(kind_of(parse_json(R"(3)", "")), ResultKind::kUnknown);
}

TEST(CalibrationSection, RecommendedFirstWithErrorBars) {
  const auto section = calibration_section(parse_json(kCalibrate, ""), "yard");
  const auto tables = blocks_of<Table>(section);
  ASSERT_EQ(tables.size(), 2u);  // methods, diagnostics
  const auto& methods = *tables[0];
  ASSERT_EQ(methods.rows.size(), 3u);
  EXPECT_TRUE(methods.rows[0].highlighted);
  EXPECT_EQ(methods.rows[0].cells[0].text, "replay");
  EXPECT_EQ(methods.rows[0].cells[1].value, 1.2);
  EXPECT_EQ(methods.rows[0].cells[1].error, 1e-5);
  EXPECT_EQ(methods.rows[0].cells[2].error, 0.002);
  EXPECT_EQ(methods.rows[2].cells.back().verdict, Verdict::kBad);
  EXPECT_EQ(methods.rows[2].note, "the chord is zero");
  for (const auto& row : methods.rows) EXPECT_EQ(row.cells.size(), methods.columns.size());
  const auto intervals = blocks_of<Intervals>(section);
  ASSERT_EQ(intervals.size(), 2u);
  EXPECT_EQ(intervals[0]->rows.size(), 2u);  // the invalid method has no bar
}

TEST(CertificateSection, ConstantsAndCorrelation) {
  const auto json = parse_json(
      R"({"kind": "certificate", "vehicle": "truck 7", "method": "replay", "valid": true, "k": 1.2, "k_std": 1e-4,
    "eps_deg": 1, "eps_std_deg": 0.01, "covariance": [[1e-8, 5e-7], [5e-7, 1e-4]], "input_hash": "ab"})",
      "");
  const auto section = certificate_section(json, "");
  const auto certificates = blocks_of<Certificate>(section);
  ASSERT_EQ(certificates.size(), 1u);
  const auto& c = *certificates[0];
  ASSERT_EQ(c.constants.size(), 2u);
  EXPECT_EQ(c.constants[1].name, "mounting angle");
  EXPECT_EQ(c.constants[1].sigma, 0.01);
  ASSERT_EQ(c.correlation.size(), 2u);
  EXPECT_NEAR(c.correlation[0][1], 0.5, 1e-12);  // 5e-7 / (1e-4 * 1e-2)
  EXPECT_EQ(c.verdict, Verdict::kGood);
}

// As `loxo calibrate -o` writes it: the certificate in front, how it came about below.
TEST(CertificateSection, WithItsMethods) {
  const auto json = parse_json(
      R"({"command":"certificate","format":1,"name":"truck 7","vehicle":"truck 7","recommended":"least_squares",
    "recommended_why":"several benchmarks","method":"least_squares","valid":true,"k":1.2,"k_std":1e-4,"eps_deg":1,
    "eps_std_deg":0.01,"correlation":0.1,"input_hash":"ab","metres_per_pulse":null,
    "methods":{"least_squares":{"k":1.2,"k_std":1e-4,"eps_deg":1,"eps_std_deg":0.01,"valid":true,"chi2":3.1,"dof":4,
    "heading_drift_deg_h":0.5,"heading_drift_std_deg_h":0.1,"residuals":[{"name":"B","north_m":-0.5,"east_m":0.25}]},
    "replay":{"k":1.21,"k_std":1e-3,"eps_deg":1.1,"eps_std_deg":0.1,"valid":true}}})",
      "");
  EXPECT_EQ(kind_of(json), ResultKind::kCertificate);
  const auto section = result_section(json, "");
  ASSERT_EQ(blocks_of<Certificate>(section).size(), 1u);
  EXPECT_EQ(blocks_of<Certificate>(section)[0]->constants.size(), 2u);
  EXPECT_EQ(blocks_of<Intervals>(section).size(), 2u);
  const auto tables = blocks_of<Table>(section);
  ASSERT_EQ(tables.size(), 2u);  // methods, residuals
  EXPECT_EQ(tables[1]->rows.size(), 1u);
  EXPECT_EQ(tables[1]->rows[0].cells[1].text, "−0.5");
  EXPECT_EQ(tables[1]->columns.size(), 3u);  // no heights
  const auto pairs = blocks_of<KeyValues>(section);
  ASSERT_EQ(pairs.size(), 1u);
  ASSERT_EQ(pairs[0]->rows.size(), 2u);  // the drift, chi2
  EXPECT_EQ(pairs[0]->rows[0].first, "heading drift");
  ASSERT_FALSE(blocks_of<Text>(section).empty());
  EXPECT_NE(blocks_of<Text>(section)[0]->text.find("several benchmarks"), std::string::npos);
}

TEST(ReproductionSection, CountsVerdicts) {
  const auto section = reproduction_section(
      parse_json(
          R"([{"id":"a","paper":"yu2023","quantity":"k","printed":1,"ours":1,"tolerance":1e-3,"verdict":"reproduced","note":""},
    {"id":"b","paper":"yu2023","quantity":"k","printed":1,"ours":2,"tolerance":null,"verdict":"failed","note":"why"}])",
          ""),
      "");
  const auto texts = blocks_of<Text>(section);
  ASSERT_EQ(texts.size(), 1u);
  EXPECT_EQ(texts[0]->verdict, Verdict::kBad);
  EXPECT_NE(texts[0]->text.find("1 failed"), std::string::npos);
  EXPECT_EQ(blocks_of<Table>(section)[0]->rows.size(), 2u);
}

TEST(AllanSection, CoefficientsAndCurves) {
  const auto section = allan_section(
      parse_json(
          R"({"command":"allan","axes":{"gyro_x":{"angle_random_walk_deg_sqrt_h":0.1,"angle_random_walk_deg_sqrt_h_std":0.01,
    "tau_s":[1,2,4],"deviation_deg_h":[3,2,1],"deviation_low_deg_h":[2,1,0.5],"deviation_high_deg_h":[4,3,2],"fit_deg_h":[3,2,1]}}})",
          ""),
      "");
  const auto tables = blocks_of<Table>(section);
  ASSERT_EQ(tables.size(), 1u);
  EXPECT_EQ(tables[0]->rows[0].cells[1].error, 0.01);
  const auto series = blocks_of<Series>(section);
  ASSERT_EQ(series.size(), 1u);
  ASSERT_EQ(series[0]->curves.size(), 2u);
  EXPECT_TRUE(series[0]->x.log);
  EXPECT_EQ(series[0]->curves[0].hi.size(), 3u);
}

TEST(PlainSection, RootsAndBudgetsAreDrawn) {
  const auto roots = plain_section(
      parse_json(
          R"({"command":"analyze roots","roots":[{"name":"Schuler","re":0,"im":1.24e-3},{"re":0,"im":-1.24e-3}]})",
          ""),
      "roots");
  ASSERT_EQ(blocks_of<Roots>(roots).size(), 1u);
  EXPECT_EQ(blocks_of<Roots>(roots)[0]->roots[1].im, -1.24e-3);
  const auto budget = plain_section(
      parse_json(
          R"({"command":"analyze budget","t_s":[0,1,2],"sources":[{"source":"gyro bias","std_m":[0,1,2]},{"source":"scale","std_m":[0,3,4]}]})",
          ""),
      "b");
  ASSERT_EQ(blocks_of<StackedArea>(budget).size(), 1u);
  const auto& stack = *blocks_of<StackedArea>(budget)[0];
  ASSERT_EQ(stack.layers.size(), 2u);
  EXPECT_EQ(stack.layers[1].y[2], 16);  // 4 m squared: variances add
  EXPECT_EQ(stack.y.unit, "(m)²");
  EXPECT_EQ(blocks_of<Series>(budget)[0]->curves[1].y[2], 4);
}

TEST(ResultSections, SurviveWhatTheyDoNotKnow) {
  for (
      const char* text :
      {"{}", "[]", "[1]",
       R"({"command":"x","list":[{"a":1,"a_std":0.1},{"b":"c"}],"deep":{"deeper":{"x":1}},"empty":[],"nothing":null})",
       R"({"command":"calibrate","methods":[],"diagnostics":{}})",
       R"({"command":"calibrate","methods":{"replay":{}}})", R"({"certificate":3})",
       R"({"command":"evaluate","require":{},"by_length":[1]})",
       R"({"command":"allan","axes":{"x":3}})", R"({"command":"reproduce","checks":3})"})
    EXPECT_NO_THROW(result_section(parse_json(text, ""), "x")) << text;
}

}  // namespace
}  // namespace loxo::report
