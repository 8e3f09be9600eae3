// SPDX-License-Identifier: Apache-2.0
// `loxo reproduce` as a user runs it.
#include <gtest/gtest.h>

#include <set>

#include "loxo/text/json.hpp"
#include "program.hpp"

namespace loxo {
namespace {

using testing::run;

TEST(Reproduce, ListsTheChecksOfAPaperAsPromised) {
  const auto r = run("reproduce yu2023 --json");
  ASSERT_EQ(r.exit_code, 0) << r.err;
  EXPECT_EQ(r.err, "");
  const Json list = parse_json(r.out, "stdout");
  ASSERT_TRUE(list.is_array());
  EXPECT_GE(list.size(), 90u);
  const std::set<std::string> keys = {"id",   "paper",     "quantity", "printed",
                                      "ours", "tolerance", "verdict",  "note"};
  int corrected = 0;
  for (const auto& check : list) {
    std::set<std::string> found;
    for (const auto& [key, value] : check.items()) found.insert(key);
    EXPECT_EQ(found, keys);
    EXPECT_EQ(check["paper"], "yu2023");
    EXPECT_TRUE(check["ours"].is_number()) << check["id"];
    EXPECT_TRUE(check["printed"].is_number() || check["printed"].is_null());
    const std::string verdict = check["verdict"];
    EXPECT_TRUE(verdict == "reproduced" || verdict == "corrected") << check["id"];
    corrected += verdict == "corrected";
    if (verdict == "reproduced" && check["tolerance"].is_number()) {
      EXPECT_LE(std::abs(check["ours"].get<double>() - check["printed"].get<double>()),
                check["tolerance"].get<double>())
          << check["id"];
    }
  }
  EXPECT_GT(corrected, 0);
}

TEST(Reproduce, WritesAReportAndTheFiguresAsTables) {
  const std::string folder = testing::scratch_folder() + "/papers";
  const auto r = run("reproduce yu2023 -o " + folder);
  ASSERT_EQ(r.exit_code, 0) << r.err;
  EXPECT_NE(r.out.find("S0-F5-a"), std::string::npos);
  EXPECT_NE(r.out.find("none failed"), std::string::npos);
  const std::string page = testing::slurp(folder + "/report.html");
  EXPECT_NE(page.find("Figure 5"), std::string::npos);
  EXPECT_NE(page.find("E-10"), std::string::npos);
  EXPECT_LT(page.size(), 2'000'000u);
  const auto csv = testing::columns(testing::slurp(folder + "/yu2023-figure4-eps.csv"));
  EXPECT_EQ(csv.count("curve") + csv.count("x") + csv.count("y"), 3u);
  EXPECT_GT(csv.at("y").size(), 100u);
  // The page of checks that `loxo report` makes of the same list.
  EXPECT_EQ(run("report " + folder + "/checks.json -o " + folder + "/again.html").exit_code, 0);
}

// One run has the same median and 95 % value: not both can be as expected.
TEST(Reproduce, AMissedValueIsExitCodeFour) {
  const auto r = run("reproduce wang2012 --runs 1");
  EXPECT_EQ(r.exit_code, 4) << r.err;
  EXPECT_NE(r.out.find("failed"), std::string::npos);
  EXPECT_NE(r.out.find("expected"), std::string::npos) << r.out;
}

TEST(Reproduce, RefusesWhatItDoesNotKnow) {
  const auto r = run("reproduce yu2032");
  EXPECT_EQ(r.exit_code, 2);
  EXPECT_NE(r.err.find("yu2023"), std::string::npos) << r.err;
  EXPECT_EQ(run("reproduce --threads -1").exit_code, 2);
  EXPECT_EQ(run("reproduce yu2023 -o -").exit_code, 2);
  const auto blocked = run("reproduce yu2023 --quiet -o /dev/null/x");
  EXPECT_EQ(blocked.exit_code, 1);
  EXPECT_NE(blocked.err.find("/dev/null/x"), std::string::npos) << blocked.err;
}

}  // namespace
}  // namespace loxo
