// SPDX-License-Identifier: Apache-2.0
// The papers as a whole: nothing fails, nothing is orphaned, nothing is copied, nothing depends on
// threads. The voyage of polar.md 9.2 and the hours of vehicle.md 7.3 are run here.
#include "loxo/papers/reproduce.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "loxo/num/error.hpp"
#include "shared_folder.hpp"

namespace loxo::papers {
namespace {

std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

bool all_runs() { return std::getenv("LOXO_LONG") != nullptr; }
// Wang's distributions with a few runs here; what they must reach is asked with LOXO_LONG=1.
Options short_options() {
  Options o;
  if (!all_runs()) o.runs = 3, o.brief = true;
  return o;
}
bool statistical(const Paper& paper) { return paper.name == "wang2012" && !all_runs(); }

const std::vector<Paper>& once() {
  static const std::vector<Paper> done = [] {
    std::vector<Paper> list;
    for (const auto& p : papers()) list.push_back(p.run(short_options()));
    return list;
  }();
  return done;
}

TEST(Papers, NothingFailsAndEachCorrectionNamesItsErratum) {
  std::set<std::string> known, ids;
  for (const auto& e : errata()) EXPECT_TRUE(known.insert(e.id).second) << e.id << " twice";
  const std::string page =
      text_of(std::filesystem::path(testing::source_folder()) / "docs/spec/errata.md");
  std::size_t count = 0;
  for (const auto& paper : once()) {
    for (const auto& c : paper.checks) {
      ++count;
      EXPECT_TRUE(ids.insert(c.claim.id).second) << c.claim.id << " twice";
      const std::string id = c.claim.id;
      if (statistical(paper)) continue;
      if (!all_runs() &&
          (id.rfind("GEO-MISS", 0) == 0 || (id.rfind("NAV-", 0) == 0 && std::isnan(c.ours))))
        continue;
      EXPECT_NE(c.verdict, Verdict::kFailed) << c.claim.id << " ours " << c.ours << " " << c.note;
      if (c.verdict != Verdict::kCorrected) continue;
      const std::string erratum = c.claim.erratum;
      EXPECT_TRUE(known.count(erratum)) << c.claim.id << ": " << erratum;
      EXPECT_NE(c.note.find(erratum), std::string::npos) << c.claim.id << ": " << c.note;
      EXPECT_NE(page.find("| " + erratum + " |"), std::string::npos) << erratum;
    }
  }
  std::printf("%zu checks\n", count);
  EXPECT_GE(count, 100u);
}

// Every row of the specification's tables of expected values is a check, or is named in a test; a
// family of rows that one test reads from the table itself is named by its prefix.
TEST(Papers, NoExpectedRowIsOrphaned) {
  const auto vehicle = testing::expected_rows("vehicle-expected.csv"),
             polar = testing::expected_rows("polar-expected.csv");
  if (vehicle.empty() || polar.empty()) GTEST_SKIP() << "no tables of expected values";
  std::set<std::string> checks;
  for (const auto& paper : once())
    for (const auto& c : paper.checks) {
      const std::string id = c.claim.id;
      checks.insert(id);
      checks.insert(id.substr(0, id.find('/')));
    }
  const std::filesystem::path root = testing::source_folder();
  std::string tests;
  for (const char* folder : {"loxo", "tests"})
    for (const auto& file : std::filesystem::recursive_directory_iterator(root / folder)) {
      const std::string name = file.path().filename().string();
      if (name.size() > 9 && name.substr(name.size() - 9) == "_test.cpp" &&
          name != "reproduce_test.cpp")
        tests += text_of(file.path());
    }
  const struct {
    const char *prefix, *file, *test;
  } families[] = {{"S0-GRID-", "loxo/calibrate/two_point_test.cpp", "TEST(TwoPoint, ErrorCurves)"},
                  {"RESP-P", "loxo/errors/static_response_test.cpp",
                   "TEST(StaticResponse, EveryRowOfTheTableOfResponses)"},
                  {"INIT-P", "loxo/errors/static_response_test.cpp",
                   "TEST(StaticResponse, EveryRowOfTheTableOfResponses)"}};
  for (const auto& f : families) {
    const std::string text = text_of(root / f.file);
    EXPECT_NE(text.find(f.prefix), std::string::npos) << f.file;
    EXPECT_NE(text.find(f.test), std::string::npos) << f.file;
  }
  int by_check = 0, by_family = 0, by_name = 0;
  for (const auto* table : {&vehicle, &polar})
    for (const auto& [id, row] : *table) {
      if (checks.count(id) > 0) {
        ++by_check;
        continue;
      }
      bool family = false;
      for (const auto& f : families) family |= id.rfind(f.prefix, 0) == 0;
      if (family) {
        ++by_family;
        continue;
      }
      const bool named = tests.find("[" + id + "]") != std::string::npos ||
                         tests.find("\"" + id + "\"") != std::string::npos;
      EXPECT_TRUE(named) << id << " is an orphan";
      by_name += named;
    }
  std::printf("%d rows by a check, %d in families, %d by name\n", by_check, by_family, by_name);
}

// The pages are what the program writes now: run `loxo reproduce --docs > docs/papers.md` and
// `loxo reproduce --errata` where this fails.
TEST(Papers, PagesAreCurrent) {
  const std::filesystem::path docs = std::filesystem::path(testing::source_folder()) / "docs";
  const std::string errata_md = text_of(docs / "spec/errata.md");
  EXPECT_NE(errata_md.find(errata_page()), std::string::npos);
  const std::string page = text_of(docs / "papers.md");
  for (const auto& paper : once()) {
    if (statistical(paper)) continue;
    EXPECT_NE(page.find(paper.page), std::string::npos) << paper.name << "\n" << paper.page;
  }
}

// One constant of the model changed: rows must fail, or they were not computed.
TEST(Papers, AChangedConstantIsSeen) {
  const struct {
    const char* what;
    Model model;
    std::vector<std::pair<const char*, int>> at_least;  // rows that fail
  } cases[] = {
      {"Earth radius 0.1 % larger",
       {1.001, 1, 1, 1, 1},
       {{"yu2023", 20}, {"shi2015", 3}, {"liu2014", 20}}},
      {"Earth rate 3 % faster",
       {1, 1.03, 1, 1, 1},
       {{"shi2015", 3}, {"liu2014", 10}, {"bian2022", 1}}},
      {"gravity 0.1 % larger", {1, 1, 1.001, 1, 1}, {{"liu2014", 10}}},
      {"mounting angle of the other sign",
       {1, 1, 1, -1, 1},
       {{"yu2023", 40}, {"shi2015", 5}, {"wang2012", 1}}},
      {"gyro drift 2 % larger", {1, 1, 1, 1, 1.02}, {{"shi2015", 5}, {"liu2014", 20}}},
  };
  for (const auto& c : cases)
    for (const auto& [name, least] : c.at_least)
      for (const auto& p : papers()) {
        if (std::string(p.name) != name) continue;
        Options o = short_options();
        o.model = c.model;
        o.runs = 1;
        o.brief = true;
        int n = 0;  // of those that are computed
        for (const auto& x : p.run(o).checks)
          n += x.verdict == Verdict::kFailed && !std::isnan(x.ours);
        std::printf("%s: %d rows of %s fail\n", c.what, n, name);
        EXPECT_GE(n, least) << c.what << " in " << name;
      }
}

TEST(Papers, TwoRunsAreTheSameBytesOnAnyNumberOfThreads) {
  Options o = short_options();
  o.threads = 1;
  std::vector<Paper> again;
  for (const auto& p : papers()) again.push_back(p.run(o));
  EXPECT_EQ(dump_json(to_json(once())), dump_json(to_json(again)));
  for (std::size_t i = 0; i < again.size(); ++i) {
    ASSERT_EQ(once()[i].figures.size(), again[i].figures.size());
    EXPECT_EQ(once()[i].page, again[i].page);
    for (std::size_t j = 0; j < again[i].figures.size(); ++j)
      EXPECT_EQ(figure_csv(once()[i].figures[j]), figure_csv(again[i].figures[j]));
  }
}

TEST(Papers, TheJudgeIsStrict) {
  const Claim value{"a", "", Kind::kValue, 7, 0.5, 7.07, 0.01, false, "", ""};
  EXPECT_EQ(judge(value, 7.07), Verdict::kReproduced);
  EXPECT_EQ(judge(value, 7.2), Verdict::kFailed);  // as printed, but not as derived
  EXPECT_EQ(judge(value, std::nan("")), Verdict::kFailed);
  Claim wrong = value;
  wrong.printed = 3;
  EXPECT_EQ(judge(wrong, 7.07), Verdict::kFailed);  // no erratum, no correction
  wrong.erratum = "E-1";
  EXPECT_EQ(judge(wrong, 7.07), Verdict::kCorrected);
  EXPECT_EQ(judge(wrong, 3), Verdict::kFailed);  // the print is no help
  const Claim most{"a", "", Kind::kAtMost, 1, kNotPrinted, -0.9, 0.01, false, "", ""};
  EXPECT_EQ(judge(most, -0.9), Verdict::kReproduced);
  const Claim bound{"a", "", Kind::kAtLeast, 0.9, kNotPrinted, 1e-3, 0, true, "", ""};
  EXPECT_EQ(judge(bound, 1e-4), Verdict::kFailed);
  EXPECT_EQ(judge(bound, std::nan("")), Verdict::kFailed);
}

TEST(Papers, ABookKnowsItsClaims) {
  static constexpr Claim claims[] = {
      {"a", "", Kind::kFigure, kNotPrinted, kNotPrinted, 1, 0.1, false, "", ""},
      {"b", "", Kind::kFigure, kNotPrinted, kNotPrinted, 1, 0.1, false, "", ""}};
  Paper paper;
  Book book(paper, claims);
  book.add("a", 1.05);
  EXPECT_THROW(book.add("a", 1), Error);
  EXPECT_THROW(book.add("c", 1), Error);
  book.close("a is {{a:.1f}}, b {{b}}");
  EXPECT_EQ(paper.page, "a is 1.1, b nan");
  ASSERT_EQ(paper.checks.size(), 2u);
  EXPECT_EQ(paper.checks[1].verdict, Verdict::kFailed);  // never answered
}

}  // namespace
}  // namespace loxo::papers
