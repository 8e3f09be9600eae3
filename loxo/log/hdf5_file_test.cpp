// SPDX-License-Identifier: Apache-2.0
#include "loxo/log/hdf5_file.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "loxo/num/error.hpp"

namespace loxo {
namespace {

namespace fs = std::filesystem;

class H5 : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = (fs::temp_directory_path() / ("loxo_h5_" + std::to_string(::getpid()))).string();
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name = "x.h5") const { return folder_ + "/" + name; }
  // t = i / 3 is no round number in binary, so that bits are compared, not printouts.
  std::string make(std::size_t rows, const std::string& group = "") const {
    H5Writer h5(path());
    h5.begin(group, {"t_s", "word", "a/b [m]"}, {"word"});
    h5.attribute("mode", "test");
    for (std::size_t i = 0; i < rows; ++i) {
      const double x[] = {static_cast<double>(i) / 3, i % 5 == 0 ? std::nan("") : -0.1};
      const std::string text = "w" + std::to_string(i % 7);
      const std::string_view words[] = {text};
      h5.row(x, words);
    }
    h5.commit();
    return path();
  }
  static std::string fault(auto&& f) {
    try {
      f();
    } catch (const Error& e) {
      return std::to_string(e.exit_code()) + " " + e.what();
    }
    return "";
  }
  std::string folder_;
  Diagnostics d_;
};

// One block, a block to the row, several and a part.
TEST_F(H5, RowsComeBackBitByBit) {
  for (const std::size_t n : {0u, 1u, 16384u, 40000u}) {
    SCOPED_TRACE(n);
    fs::remove(path());
    const auto table = open_h5_table(make(n, "imu"), "imu");
    EXPECT_EQ(table->header(), (std::vector<std::string>{"t_s", "word", "a/b [m]"}));
    EXPECT_EQ(table->word_columns(), std::vector<std::string>{"word"});
    EXPECT_EQ(table->meta().at("mode"), "test");
    table->select({"a/b [m]", "t_s"});
    double row[2];
    std::size_t i = 0;
    for (; table->next(row, d_); ++i) {
      ASSERT_EQ(row[1], static_cast<double>(i) / 3);
      ASSERT_EQ(std::isnan(row[0]), i % 5 == 0);
      ASSERT_EQ(table->word("word"), "w" + std::to_string(i % 7));
    }
    EXPECT_EQ(i, n);
    EXPECT_EQ(table->rows(), n);
  }
}

TEST_F(H5, TextsLinksAndTheListOfTables) {
  {
    H5Writer h5(path());
    h5.text("drive.toml", "format = 1\n");
    h5.begin("b", {"t_s"});
    const double x[] = {1.5};
    h5.row(x);
    h5.begin("a", {"t_s"});
    h5.link("b", "c");
    h5.commit();
  }
  EXPECT_EQ(h5_text(path(), "drive.toml"), "format = 1\n");
  EXPECT_EQ(h5_text(path(), "nothing"), std::nullopt);
  EXPECT_EQ(h5_tables(path()), (std::vector<std::string>{"b", "a", "c"}));
  double row[1];
  const auto c = open_h5_table(path(), "c");
  c->select({"t_s"});
  ASSERT_TRUE(c->next(row, d_));
  EXPECT_EQ(row[0], 1.5);
}

TEST_F(H5, FaultsNameTheirPlace) {
  make(3, "imu");
  const auto has = [](const std::string& text, const std::string& word) {
    EXPECT_NE(text.find(word), std::string::npos) << "'" << word << "' in: " << text;
  };
  const std::string group = fault([&] { open_h5_table(path(), "imo"); });
  has(group, "3 ");
  has(group, "imu");
  has(fault([&] { open_h5_table(path(), "imu")->select({"t"}); }), "t_s");
  has(fault([&] { open_h5_table(path(), ""); }), "imu");
  has(fault([&] { open_h5_table(path("none.h5"), ""); }), "no such file");
  has(fault([&] { H5Writer(path("none/x.h5")); }), "1 ");
}

TEST_F(H5, AFileThatWasNotCommittedIsNotThere) {
  {
    H5Writer h5(path());
    h5.begin("", {"t_s"});
    const double x[] = {1};
    h5.row(x);
  }
  EXPECT_TRUE(fs::is_empty(folder_));
}

// Damage is told, and never a crash: every cut, and a changed byte anywhere in the first kilobytes.
TEST_F(H5, DamageIsTold) {
  make(100, "imu");
  std::ostringstream all;
  all << std::ifstream(path(), std::ios::binary).rdbuf();
  const std::string whole = all.str();
  const auto read = [&](const std::string& bytes) {
    std::ofstream(path("y.h5"), std::ios::binary) << bytes;
    if (!is_h5(path("y.h5"))) return std::string("no HDF5");
    return fault([&] {
      const auto table = open_h5_table(path("y.h5"), "imu");
      table->select({"t_s"});
      double row[1];
      while (table->next(row, d_)) table->word("word");
    });
  };
  EXPECT_EQ(read(whole), "");
  for (std::size_t cut = 0; cut < whole.size(); cut += 499)
    EXPECT_NE(read(whole.substr(0, cut)), "") << cut;
  std::size_t told = 0;
  for (std::size_t at = 0; at < std::min<std::size_t>(whole.size(), 1500); at += 11) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x55);
    told += read(bytes).empty() ? 0 : 1;
  }
  EXPECT_GT(told, 30u);
}

}  // namespace
}  // namespace loxo
