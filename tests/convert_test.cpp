// SPDX-License-Identifier: Apache-2.0
// The binary form as a user meets it: drives and solutions as .h5, there and back, and every
// command that reads them.
#include <gtest/gtest.h>

#include "loxo/text/json.hpp"
#include "program.hpp"

namespace loxo::testing {
namespace {

namespace fs = std::filesystem;

// Ten seconds of a moving car with everything that a scenario writes; made once.
const std::string& drive() {
  static const std::string folder = [] {
    const std::string path = scratch_folder() + "/convert_drive";
    std::ofstream(scratch_folder() + "/convert.toml")
        << "format = 1\nabout = \"short\"\n[start]\nlat_deg = 45\nlon_deg = 179.9999\nh_m = 10.0\n"
           "course = \"80 deg\"\n[[leg]]\nduration = \"10 s\"\nspeed = \"15 m/s\"\n"
           "[[leg]]\nduration = \"20 s\"\n[imu]\nrate = \"50 Hz\"\n[odometer]\nk = 1.02\n"
           "[attitude]\nheading_bias = \"30 arcsec\"\n[fix]\nposition = \"2 m\"\n"
           "[[benchmark]]\nname = \"A\"\nat = \"start\"\nstd = \"0.05 m\"\n"
           "[[benchmark]]\nname = \"B\"\nat = \"end\"\nstd = \"0.05 m\"\n";
    const Outcome o = run("simulate " + scratch_folder() + "/convert.toml -o " + path);
    EXPECT_EQ(o.exit_code, 0) << o.err;
    return path;
  }();
  return folder;
}
const std::string& binary() {
  static const std::string path = [] {
    std::string to = scratch_folder() + "/convert_drive.h5";
    const Outcome o = run("convert " + drive() + " " + to);
    EXPECT_EQ(o.exit_code, 0) << o.err;
    return to;
  }();
  return path;
}
std::string without_head(const std::string& text) {
  std::istringstream lines(text);
  std::string out;
  for (std::string line; std::getline(lines, line);)
    if (line.empty() || line[0] != '#') out += line + "\n";
  return out;
}

TEST(Convert, ADriveThereAndBackIsTheSameFolder) {
  const std::string back = scratch_folder() + "/convert_back";
  const Outcome o = run("convert --json " + binary() + " " + back);
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const Json j = parse_json(o.out, "convert");
  EXPECT_EQ(j["command"], "convert");
  EXPECT_EQ(j["kind"], "drive");
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(drive())) {
    const std::string name = entry.path().filename().string();
    EXPECT_EQ(slurp(entry.path().string()), slurp(back + "/" + name)) << name;
    ++files;
  }
  EXPECT_GE(files, 6u);
  EXPECT_EQ(j["tables"].get<std::size_t>(), files - 1);
}

// The same numbers from the folder and from the file, in every command that takes a drive.
TEST(Convert, EveryCommandReadsTheBinaryDrive) {
  const std::string solution = scratch_folder() + "/convert_sol.h5";
  run("navigate " + binary() + " --mode inertial -o " + solution);
  for (const std::string& command : std::vector<std::string>{
           "inspect --json DRIVE", "calibrate --json DRIVE", "navigate DRIVE --mode reckon -o -",
           "navigate DRIVE --mode inertial -o -", "navigate DRIVE --mode filter -o -",
           "evaluate --json " + solution + " --truth DRIVE"}) {
    SCOPED_TRACE(command);
    const auto with = [&](const std::string& path) {
      std::string c = command;
      c.replace(c.find("DRIVE"), 5, path);
      Outcome o = run(c);
      std::string text = without_head(o.out);
      for (std::size_t at; (at = text.find(path)) != std::string::npos;)
        text.replace(at, path.size(), "DRIVE");
      // A section's file is the drive itself in the one and a file in its folder in the other.
      for (std::size_t at = 0; (at = text.find("DRIVE/", at)) != std::string::npos; ++at)
        text.erase(at + 5, text.find('"', at) - at - 5);
      return std::to_string(o.exit_code) + text + (o.exit_code == 0 ? "" : o.err);
    };
    const std::string folder = with(drive()), file = with(binary());
    EXPECT_EQ(folder.substr(0, 1), "0") << folder;
    EXPECT_TRUE(folder == file) << folder.substr(0, 600) << "\n----\n" << file.substr(0, 600);
  }
}

TEST(Convert, ASolutionInBinaryIsAtFullRateAndReadsBack) {
  const std::string h5 = scratch_folder() + "/full.h5", csv = scratch_folder() + "/full.csv";
  ASSERT_EQ(run("navigate " + drive() + " --mode inertial -o " + h5).exit_code, 0);
  ASSERT_EQ(run("convert " + h5 + " " + csv).exit_code, 0);
  const auto table = columns(slurp(csv));
  EXPECT_EQ(table.at("t_s").size(), 1501u);  // the start and 30 s at 50 Hz
  EXPECT_EQ(table.at("frame")[0], "geographic");
  EXPECT_NE(slurp(csv).find("# mode: inertial"), std::string::npos);
  EXPECT_NE(slurp(csv).find(
                "t_s,lat_deg,lon_deg,h_m,ve_mps,vn_mps,vu_mps,roll_deg,pitch_deg,heading_deg,qw,qx,"
                "qy,qz,x_m,y_m,z_m,std_e_m,std_n_m,std_u_m,std_heading_deg,frame,health\n"),
            std::string::npos);
  // CSV to HDF5 and back: the same bytes.
  const std::string again = scratch_folder() + "/again";
  ASSERT_EQ(run("convert " + csv + " " + again + ".h5").exit_code, 0);
  ASSERT_EQ(run("convert " + again + ".h5 " + again + ".csv").exit_code, 0);
  EXPECT_EQ(slurp(csv), slurp(again + ".csv"));
  // Both judge the same.
  const std::string truth = " --truth " + drive() + " --json";
  const auto strip = [](Json j) {
    j.erase("solution");
    return j.dump();
  };
  EXPECT_EQ(strip(parse_json(run("evaluate " + h5 + truth).out, "h5")),
            strip(parse_json(run("evaluate " + csv + truth).out, "csv")));
  EXPECT_EQ(run("report " + h5 + " " + binary() + " -o " + scratch_folder() + "/r.html").exit_code,
            0);
  EXPECT_EQ(run("inspect " + h5).exit_code, 0);
  for (const std::string mode : {"reckon", "filter", "smooth"}) {
    const Outcome o = run("navigate " + binary() + " --mode " + mode + " -o " + again + ".h5");
    EXPECT_EQ(o.exit_code, 0) << mode << o.err;
    EXPECT_EQ(run("evaluate " + again + ".h5 --truth " + drive()).exit_code, 0) << mode;
  }
}

// Bad rows keep their number, because a benchmark may be known by it; texts and odd names go over.
TEST(Convert, RowsKeepTheirNumberAndTextsGoOver) {
  const std::string folder = scratch_folder() + "/odd";
  fs::create_directories(folder);
  std::ofstream(folder + "/drive.toml")
      << "[track]\nfile = 'a b.csv' # the file\ncolumns = { time = \"t_s\", distance = \"d\", "
         "heading = \"heading_deg\" }\nunits = { distance = \"m\" }\n"
         "[[benchmark]]\nafter_row = 0\nlat_deg = 55\nlon_deg = 10\n"
         "[[benchmark]]\nafter_row = 4\nlat_deg = 55.001\nlon_deg = 10\n";
  std::ofstream(folder + "/a b.csv") << "t_s,d,heading_deg,\"note, with /\"\n1,30,0,\"x, y\"\n"
                                        "2,oops,0,b\n3,40,0,\n4,41.3,0,c\n5,1,0,d\n";
  const std::string h5 = scratch_folder() + "/odd.h5", back = scratch_folder() + "/odd_back";
  const Outcome to = run("convert " + folder + " " + h5);
  ASSERT_EQ(to.exit_code, 0) << to.err;
  EXPECT_NE(to.err.find("a b.csv:3"), std::string::npos) << to.err;
  ASSERT_EQ(run("convert " + h5 + " " + back).exit_code, 0);
  EXPECT_EQ(slurp(back + "/track.csv"), "");
  EXPECT_EQ(slurp(back + "/a b.csv"),
            "t_s,d,heading_deg,\"note, with /\"\n1,30,0,\"x, y\"\nnan,nan,nan,\n3,40,0,\n"
            "4,41.3,0,c\n5,1,0,d\n");
  const auto k = [](const std::string& path) {
    return parse_json(run("calibrate --json " + path).out, "k")["methods"]["replay"]["k"].dump();
  };
  EXPECT_EQ(k(folder), k(h5));
  EXPECT_EQ(k(folder), k(back));
}

TEST(Convert, Refusals) {
  struct Case {
    std::string command, word;
    int code;
  };
  const std::string tmp = scratch_folder() + "/";
  std::ofstream(tmp + "no_drive.csv") << "a,b\n1,2\n";
  for (const Case& c : std::vector<Case>{
           {"convert " + tmp + "nothing.csv " + tmp + "x.h5", "no such file", 3},
           {"convert " + drive(), "where to write", 2},
           {"convert " + drive() + " " + tmp + "x.csv", "folder", 2},
           {"convert " + drive() + " " + drive(), "itself", 2},
           {"convert " + binary() + " " + drive(), "there already", 2},
           {"convert " + tmp + "no_drive.csv " + tmp + "x.txt", ".h5", 2},
           {"convert " + tmp + "no_drive.csv " + tmp + "none/x.h5", "does not exist", 1},
           {"navigate " + drive() + " --mode inertial -o " + tmp + "none/x.h5", "does not exist",
            1},
           {"navigate " + tmp + "full.h5 --mode inertial -o " + tmp + "x.h5", "drive.toml", 3}}) {
    SCOPED_TRACE(c.command);
    if (c.command.find("full.h5") != std::string::npos)
      run("convert " + tmp + "no_drive.csv " + tmp + "full.h5");
    const Outcome o = run(c.command);
    EXPECT_EQ(o.exit_code, c.code) << o.err;
    EXPECT_NE(o.err.find(c.word), std::string::npos) << o.err;
    EXPECT_FALSE(fs::exists(tmp + "x.h5"));
  }
}

// A limit of file size stands for the full disk; what was begun is taken away.
TEST(Convert, AFullDiskLeavesNothing) {
  const std::string to = scratch_folder() + "/limited";
  fs::create_directories(to);
  for (const std::string file : {"x.h5", "x.csv", "x.csv.gz"}) {
    const std::string command = std::string("bash -c 'ulimit -f 16; ") + program() + " navigate " +
                                drive() + " --mode inertial -o " + to + "/" + file +
                                " 2>&1'; echo \"code $?\"";
    std::string text;
    std::FILE* pipe = ::popen(command.c_str(), "r");
    char part[256];
    while (std::fgets(part, sizeof part, pipe) != nullptr) text += part;
    ::pclose(pipe);
    EXPECT_NE(text.find("disk full"), std::string::npos) << file << ": " << text;
    EXPECT_NE(text.find("code 1\n"), std::string::npos) << file << ": " << text;
    EXPECT_TRUE(fs::is_empty(to)) << file;
  }
}

}  // namespace
}  // namespace loxo::testing
