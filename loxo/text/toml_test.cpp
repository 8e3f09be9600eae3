// SPDX-License-Identifier: Apache-2.0
#include "loxo/text/toml.hpp"

#include <gtest/gtest.h>

#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/json.hpp"
#include "loxo/text/nearest.hpp"
#include "refusal.hpp"

namespace loxo {
namespace {

using testing::refusal;

constexpr const char* kText = R"(format = 1
name = "yard"
[imu]
file = "imu.csv"
delay = "0.2 s"
lever = "0.4 -1.2 -0.6 m"
columns = { time = "t_s", gyro = ["gx", "gy", "gz"] }
bare = 5
axis = ["1 deg", "2 mrad"]
on = true
[[benchmark]]
name = "A"
std = "0 m"
[[benchmark]]
name = "B"
sdt = "0 m"
)";

TEST(Toml, ReadsTypedValues) {
  const auto t = TomlTable::parse(kText, "drive.toml");
  EXPECT_EQ(t.get_integer("format"), 1);
  EXPECT_EQ(t.need_string("name"), "yard");
  EXPECT_FALSE(t.get_string("nothing"));
  const auto imu = *t.get_table("imu");
  EXPECT_EQ(imu.need_quantity("delay", Dimension::kTime), 0.2);
  EXPECT_EQ((*imu.get_vector3("lever", Dimension::kLength))[1], -1.2);
  EXPECT_EQ((*imu.get_table("columns")->get_strings("gyro"))[2], "gz");
  EXPECT_EQ((*imu.get_quantities("axis", Dimension::kAngle))[1], 2e-3);
  EXPECT_EQ(imu.get_bool("on"), true);
  const auto marks = t.get_tables("benchmark");
  ASSERT_EQ(marks.size(), 2u);
  EXPECT_EQ(marks[0].need_quantity("std", Dimension::kLength), 0.0);
  EXPECT_EQ(marks[1].path(), "benchmark[1]");
}

TEST(Toml, FaultsNameFileLineColumnAndKey) {
  const auto t = TomlTable::parse(kText, "drive.toml");
  const auto imu = *t.get_table("imu");
  EXPECT_EQ(refusal([&] { imu.need_quantity("bare", Dimension::kLength); }).substr(0, 29),
            "drive.toml:8:8: key imu.bare:");
  EXPECT_NE(refusal([&] { imu.need_quantity("bare", Dimension::kLength); }).find("'5' has no unit"),
            std::string::npos);
  EXPECT_NE(refusal([&] {
              imu.get_number("file");
            }).find("drive.toml:4:8: key imu.file: expected a number, found text"),
            std::string::npos);
  EXPECT_NE(refusal([&] { imu.need_number("rate"); }).find("key imu.rate: missing"),
            std::string::npos);
  EXPECT_NE(refusal([&] { t.get_table("name"); }).find("expected a table, found text"),
            std::string::npos);
  EXPECT_NE(refusal([&] { TomlTable::parse("a = \nb = 1\n", "x.toml"); }).find("x.toml:1:"),
            std::string::npos);
  EXPECT_NE(
      refusal([&] { TomlTable::parse("a = nan\n", "x.toml").get_number("a"); }).find("finite"),
      std::string::npos);
}

TEST(Toml, UnknownKeysAreRefusedWithTheNearest) {
  const auto t = TomlTable::parse(kText, "drive.toml");
  for (const char* key : {"format", "name"}) t.has(key);
  const auto imu = *t.get_table("imu");
  for (const char* key : {"file", "delay", "lever", "bare", "axis", "on"}) imu.has(key);
  const auto columns = *imu.get_table("columns");
  columns.has("time");
  columns.has("gyro");
  for (const auto& b : t.get_tables("benchmark")) {
    b.has("name");
    b.has("std");
  }
  EXPECT_EQ(refusal([&] { t.refuse_unknown(); }),
            "drive.toml:16:1: key benchmark[1].sdt: unknown key 'sdt'; did you mean 'std'?");
  for (const auto& b : t.get_tables("benchmark")) b.has("sdt");
  EXPECT_NO_THROW(t.refuse_unknown());
}

TEST(Toml, SetReplacesAndAdds) {
  auto t = TomlTable::parse(kText, "drive.toml");
  t.set("imu.delay", "0.3 s");
  t.set("imu.bare", "7");
  t.set("odometer.scale", "\"2 m/pulse\"");
  t.set("benchmark.1.name", "C");
  EXPECT_EQ(t.get_table("imu")->need_quantity("delay", Dimension::kTime), 0.3);
  EXPECT_EQ(t.get_table("imu")->get_integer("bare"), 7);
  EXPECT_EQ(t.get_table("odometer")->need_quantity("scale", Dimension::kLengthPerPulse), 2.0);
  EXPECT_EQ(t.get_tables("benchmark")[1].need_string("name"), "C");
  EXPECT_NE(refusal([&] {
              t.get_table("imu")->need_quantity("bare", Dimension::kLength);
            }).find("--set: key imu.bare"),
            std::string::npos);
  t.set("imu.delya", "0.3 s");
  t.has("imu");
  EXPECT_THROW(t.set("benchmark.7.name", "C"), Error);
  EXPECT_THROW(t.set("name.x", "C"), Error);
  EXPECT_THROW(t.set("", "C"), Error);
}

TEST(Nearest, ByEditDistance) {
  const std::vector<std::string> names = {"heading", "pitch", "roll", "time"};
  EXPECT_EQ(nearest("haeding", names), "heading");
  EXPECT_EQ(nearest("HEADING", names), "heading");
  EXPECT_EQ(nearest("pich", names), "pitch");
  EXPECT_EQ(nearest("qqqqqq", names), "");
  EXPECT_EQ(suggestion("qqqqqq", names), "; valid: heading, pitch, roll, time");
  EXPECT_EQ(nearest("x", {}), "");
}

TEST(DiagnosticsTest, KeepsTheFirstFewAndCountsAll) {
  Diagnostics d, e;
  for (int i = 0; i < 100; ++i) d.warn("gap", std::to_string(i), "a gap");
  d.note("other", "", "x");
  EXPECT_EQ(d.count("gap"), 100u);
  EXPECT_EQ(d.list().size(), Diagnostics::kKept + 1);
  for (int i = 0; i < 3; ++i) e.warn("gap", "", "a gap");
  e.append(d);
  EXPECT_EQ(e.count("gap"), 103u);
  EXPECT_EQ(e.count("other"), 1u);
}

TEST(JsonText, FaultsHaveAPlaceAndNanIsNull) {
  EXPECT_NE(refusal([] { parse_json("{\n \"a\": oops}", "x.json"); }).find("x.json:2:"),
            std::string::npos);
  Json j = {{"a", std::nan("")}, {"b", 0.1}};
  EXPECT_EQ(dump_json(j, -1), R"({"a":null,"b":0.1})");
  EXPECT_NO_THROW(dump_json(Json("\xff\xfe")));
}

}  // namespace
}  // namespace loxo
