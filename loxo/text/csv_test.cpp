// SPDX-License-Identifier: Apache-2.0
#include "loxo/text/csv.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>

#include "loxo/num/error.hpp"
#include "loxo/text/gzip.hpp"
#include "refusal.hpp"

namespace loxo {
namespace {

namespace fs = std::filesystem;

class CsvTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "loxo-csv-XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string file(const std::string& text, const std::string& name = "a.csv") {
    const std::string path = folder_ + "/" + name;
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }
  static std::string packed(const std::string& text) {
    std::string out;
    GzipSink().deflate(text, true, out);
    return out;
  }
  std::string refusal(const std::string& path) {
    return testing::refusal([&] { CsvReader reader(path); }, path);
  }
  std::vector<std::array<double, 2>> rows(const std::string& path, Diagnostics& d) {
    CsvReader reader(path);
    reader.select({"a", "b"});
    std::vector<std::array<double, 2>> all;
    for (std::array<double, 2> row{}; reader.next(row, d);) all.push_back(row);
    return all;
  }
  std::string folder_;
};

TEST_F(CsvTest, ReadsWhatPeopleWrite) {
  const std::string text =
      "\xef\xbb\xbf# name: yard\r\n#  ellipsoid : WGS84\r\n\r\na,name,b\r\n1,x,2\r\n\r\n  3 ,\"y, "
      "z\", 4e-3\r\n# a remark\r\n\"5\",\"q\"\"q\",+6\r\n,x,NaN\r\n7,,8";
  for (const auto& path :
       {file(text), file(packed(text), "a.csv.gz"), file(packed(text), "gz-by-content.csv")}) {
    Diagnostics d;
    const auto all = rows(path, d);
    EXPECT_TRUE(d.empty()) << d.list()[0].what;
    ASSERT_EQ(all.size(), 5u);
    EXPECT_EQ(all[0][0], 1);
    EXPECT_EQ(all[1][1], 4e-3);
    EXPECT_EQ(all[2][0], 5);
    EXPECT_EQ(all[2][1], 6);
    EXPECT_TRUE(std::isnan(all[3][0]));
    EXPECT_TRUE(std::isnan(all[3][1]));
    EXPECT_EQ(all[4][1], 8);
    CsvReader reader(path);
    EXPECT_EQ(reader.meta().at("name"), "yard");
    EXPECT_EQ(reader.meta().at("ellipsoid"), "WGS84");
    std::vector<std::string_view> cells;
    ASSERT_TRUE(reader.next_text(cells));
    ASSERT_TRUE(reader.next_text(cells));
    EXPECT_EQ(cells[1], "y, z");
    ASSERT_TRUE(reader.next_text(cells));
    EXPECT_EQ(cells[1], "q\"q");
    EXPECT_EQ(reader.line(), 9u);
    EXPECT_EQ(reader.rows(), 3u);
  }
}

TEST_F(CsvTest, BadRowsAreToldWithTheirPlaceAndSkipped) {
  const auto path = file("a,b\n1,2\n3\n4,five\n6,7,8\n\"9,1\n9,inf\n1e999,1\n10,11\n");
  Diagnostics d;
  const auto all = rows(path, d);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[1][0], 10);
  EXPECT_EQ(d.count("bad_row"), 6u);
  EXPECT_EQ(d.list()[0].where, path + ":3");
  EXPECT_NE(d.list()[0].what.find("expected 2 cells, found 1"), std::string::npos);
  EXPECT_EQ(d.list()[1].where, path + ":4:3");
  EXPECT_NE(d.list()[1].what.find("expected a number in column 'b', found 'five'"),
            std::string::npos);
  EXPECT_NE(d.list()[2].what.find("found 3"), std::string::npos);
  CsvReader reader(path);
  Diagnostics ignored;
  reader.select({"a"});
  double x = 0;
  while (reader.next({&x, 1}, ignored)) {
  }
  EXPECT_EQ(reader.rows(), 8u) << "bad rows count";
}

TEST_F(CsvTest, TruncatedGzipKeepsTheRowsBefore) {
  std::string text = "a,b\n";
  std::mt19937 random(1);  // incompressible, so that the cut lies where it is meant to
  for (int i = 0; i < 100000; ++i)
    text += std::to_string(random()) + "," + std::to_string(random()) + "\n";
  const std::string whole = packed(text);
  Diagnostics d;
  const auto all = rows(file(whole.substr(0, whole.size() / 2), "cut.csv.gz"), d);
  EXPECT_EQ(d.count("truncated"), 1u);
  EXPECT_NE(d.list()[0].what.find("truncated gzip"), std::string::npos);
  EXPECT_GT(all.size(), 30000u);
  EXPECT_LT(all.size(), 70000u);
  Diagnostics none;
  EXPECT_EQ(rows(file(whole, "whole.csv.gz"), none).size(), 100000u);
  EXPECT_TRUE(none.empty());
  EXPECT_EQ(rows(file(whole + packed("6,7\n"), "two-members.csv.gz"), none).size(), 100001u);
  std::string damaged = whole;
  damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] ^ 0x55);
  rows(file(damaged, "damaged.csv.gz"), d);
  EXPECT_EQ(d.count("truncated"), 2u);
}

TEST_F(CsvTest, WhatIsNoTableIsRefused) {
  EXPECT_NE(refusal(folder_ + "/none.csv").find("no such file"), std::string::npos);
  EXPECT_NE(refusal(folder_).find("is a folder"), std::string::npos);
  EXPECT_NE(refusal(file("")).find("empty file"), std::string::npos);
  EXPECT_NE(refusal(file("\n\n# only: remarks\n")).find("no header"), std::string::npos);
  EXPECT_NE(refusal(file(std::string("ab\0cd,e\n", 8))).find("binary file"), std::string::npos);
  EXPECT_NE(refusal(file("\x89PNG\x1a\n,,\n")).find("not text"), std::string::npos);
  EXPECT_NE(refusal(file("1,2,3\n4,5,6\n")).find("no header: the first row is all numbers"),
            std::string::npos);
  EXPECT_NE(refusal(file("\xff\xfe"
                         "a\0,\0b\0"))
                .find("UTF-16"),
            std::string::npos);
  EXPECT_NE(refusal(file(packed("a,b\n1,2\n").substr(0, 12))).find("truncated gzip"),
            std::string::npos);
  Diagnostics d;
  EXPECT_TRUE(rows(file("a,b\n"), d).empty());
  EXPECT_TRUE(d.empty());
}

TEST_F(CsvTest, MissingColumnNamesTheNearest) {
  CsvReader reader(file("t_s,heading_deg,ds_m\n1,2,3\n"));
  try {
    reader.select({"t_s", "heading_dge"});
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(
        std::string(e.what()).find(
            "no column 'heading_dge'; found: t_s, heading_deg, ds_m; did you mean 'heading_deg'?"),
        std::string::npos)
        << e.what();
  }
  CsvReader twice(file("a,a\n1,2\n"));
  EXPECT_THROW(twice.index("a"), Error);
}

TEST_F(CsvTest, HeaderInACommentOtherDelimitersAndSpaces) {
  Diagnostics d;
  EXPECT_EQ(rows(file("# made by: x\n#a,b\n1,2\n3,4\n"), d).size(), 2u);
  EXPECT_EQ(rows(file("a;b\n1;2\n"), d)[0][1], 2);
  EXPECT_EQ(rows(file("a\tb\n1\t2\n"), d)[0][1], 2);
  EXPECT_TRUE(d.empty());
}

TEST_F(CsvTest, RowsAcrossTheBufferEdge) {
  std::string text = "a,skipped,b\n";
  for (int i = 0; i < 60000; ++i)
    text += std::to_string(i) + "," + std::string(static_cast<std::size_t>(i % 97), 'x') + "," +
            std::to_string(2 * i) + "\n";
  ASSERT_GT(text.size(), 3u << 20);
  Diagnostics d;
  const auto all = rows(file(text), d);
  ASSERT_EQ(all.size(), 60000u);
  EXPECT_TRUE(d.empty());
  for (std::size_t i = 0; i < all.size(); ++i) ASSERT_EQ(all[i][1], 2.0 * all[i][0]);
}

TEST(Number, ReadsBackToTheSameDouble) {
  std::mt19937_64 random(20240601);
  for (int i = 0; i < 20000; ++i) {
    const double x = std::bit_cast<double>(random());
    if (!std::isfinite(x)) continue;
    std::string text;
    append_number(text, x);
    EXPECT_EQ(std::strtod(text.c_str(), nullptr), x) << text;
  }
  std::string text;
  append_number(text, std::nan(""));
  EXPECT_EQ(text, "nan");
  text.clear();
  append_number(text, 12.3456789, 4);
  EXPECT_EQ(text, "12.35");
}

TEST_F(CsvTest, OutputAppearsWholeOrNotAtAll) {
  const std::string path = folder_ + "/out.csv";
  {
    OutputFile out(path);
    out.write("half");
    EXPECT_FALSE(fs::exists(path));
  }
  EXPECT_FALSE(fs::exists(path));
  EXPECT_TRUE(fs::is_empty(folder_));
  file("old", "out.csv");
  OutputFile out(path);
  out.write("new");
  EXPECT_EQ(read_file(path), "old");
  out.commit();
  EXPECT_EQ(read_file(path), "new");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
  OutputFile gz(folder_ + "/out.csv.gz");
  std::string big;
  for (int i = 0; i < 300000; ++i) big += std::to_string(i) + "\n";
  gz.write(big);
  gz.commit();
  EXPECT_EQ(read_file(folder_ + "/out.csv.gz"), big);
  EXPECT_LT(fs::file_size(folder_ + "/out.csv.gz"), big.size() / 2);
  EXPECT_EQ(file_hash(path).size(), 16u);
  EXPECT_EQ(file_hash(file("", "empty")), "cbf29ce484222325");  // FNV-1a's offset basis
}

TEST_F(CsvTest, FullDiskAndMissingFolderAreWorkThatFailed) {
  try {
    OutputFile out(folder_ + "/no/such/out.csv");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), 1);
    EXPECT_NE(std::string(e.what()).find("/no/such' does not exist"), std::string::npos)
        << e.what();
  }
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  OutputFile out("/dev/full");
  out.write("x");
  try {
    out.commit();
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), 1);
    EXPECT_NE(std::string(e.what()).find("disk full"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace loxo
