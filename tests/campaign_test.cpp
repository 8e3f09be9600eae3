// SPDX-License-Identifier: Apache-2.0
// Campaigns as users run them: on threads and ranks, killed and resumed, with a full disk and with
// bad input.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <random>

#include "loxo/study/campaign.hpp"
#include "program.hpp"
#include "test_seed.hpp"

namespace {
using namespace loxo;
using loxo::testing::run;
using loxo::testing::scratch_folder;

const char* const kCampaign = R"toml(
name = "kill me"
kind = "two_point"
trials = 300000
seed = 5
block = 1024
[parameters]
lat = { uniform = ["-80 deg", "80 deg"] }
course = { uniform = ["0 deg", "360 deg"] }
length = { sobol_log = ["1 km", "100 km"] }
angle_random_walk = "0.005 deg/sqrt(h)"
)toml";

std::string campaign_file() {
  const std::string path = scratch_folder() + "/kill.toml";
  std::ofstream(path) << kCampaign;
  return path;
}

// Starts the program in a process group of its own; output to /dev/null.
pid_t start(const std::vector<std::string>& words) {
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::setpgid(0, 0);
    const int nothing = ::open("/dev/null", O_RDWR);
    for (int i = 0; i < 3; ++i) ::dup2(nothing, i);
    std::vector<char*> argv;
    for (const auto& w : words) argv.push_back(const_cast<char*>(w.c_str()));
    argv.push_back(nullptr);
    ::execvp(argv[0], argv.data());
    ::_exit(127);
  }
  return pid;
}

// Every row of two stores, bit by bit.
void expect_same_rows(const std::string& a, const std::string& b) {
  const Store x(a), y(b);
  ASSERT_EQ(x.trials(), y.trials());
  for (std::uint64_t i = 0; i * x.identity().block < x.trials(); ++i) {
    const Block p = x.block(i), q = y.block(i);
    ASSERT_EQ(p.rows.size(), q.rows.size());
    for (std::size_t j = 0; j < p.rows.size(); ++j)
      ASSERT_TRUE(std::bit_cast<std::uint64_t>(p.rows[j]) ==
                      std::bit_cast<std::uint64_t>(q.rows[j]) ||
                  (std::isnan(p.rows[j]) && std::isnan(q.rows[j])))
          << "block " << i;
  }
}

const std::string& undisturbed() {
  static const std::string store = [] {
    const std::string path = scratch_folder() + "/undisturbed";
    EXPECT_EQ(run("campaign run " + campaign_file() + " --quiet -o " + path).exit_code, 0);
    return path;
  }();
  return store;
}

bool have_mpi() {
  ::setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
  ::setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
  return Ranks::built_in() && std::system("mpirun --version >/dev/null 2>&1") == 0;
}
const std::string kMpi =
    "mpirun --oversubscribe --mca mpi_yield_when_idle 1 --mca btl_base_warn_component_unused 0 -n ";

int shell(const std::string& line) {
  const int status = std::system(
      (line + " >" + scratch_folder() + "/sh.out 2>" + scratch_folder() + "/sh.err").c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

TEST(CampaignRun, KilledAtAnyInstantItEndsWithTheRowsOfAnUndisturbedRun) {
  const int kills = std::getenv("LOXO_LONG") ? 200 : 20;
  std::mt19937 gen(loxo::testing::seed());
  const std::string file = campaign_file(), whole = undisturbed();
  int done = 0, round = 0;
  while (done < kills) {
    const std::string store = scratch_folder() + "/killed" + std::to_string(round++);
    for (bool finished = false; !finished;) {
      const pid_t pid = start({loxo::testing::program(), "campaign", "run", file, "-o", store,
                               "--threads", std::to_string(1 + gen() % 3)});
      ::usleep(static_cast<useconds_t>(gen() % 150000));
      ::kill(pid, SIGKILL);
      int status = 0;
      ::waitpid(pid, &status, 0);
      if (WIFSIGNALED(status)) ++done;
      finished = (WIFEXITED(status) && WEXITSTATUS(status) == 0) || done >= kills;
      ASSERT_TRUE(WIFSIGNALED(status) || WEXITSTATUS(status) == 0);
    }
    ASSERT_EQ(run("campaign run " + file + " --quiet -o " + store).exit_code, 0);
    expect_same_rows(store, whole);
    std::filesystem::remove(store);
  }
}

TEST(CampaignRun, AnyNumberOfRanksGivesTheSameRows) {
  if (!have_mpi()) GTEST_SKIP() << "no MPI";
  for (const char* n : {"2", "4"}) {
    const std::string store = scratch_folder() + "/ranks" + n;
    ASSERT_EQ(shell(kMpi + n + " " + loxo::testing::program() + " campaign run " + campaign_file() +
                    " --threads 1 -o " + store),
              0)
        << loxo::testing::slurp(scratch_folder() + "/sh.err");
    expect_same_rows(store, undisturbed());
  }
}

TEST(CampaignRun, TheStoppingRuleGivesTheSameRowsOnAnyNumberOfRanks) {
  if (!have_mpi()) GTEST_SKIP() << "no MPI";
  const std::string file = scratch_folder() + "/stop.toml";
  std::ofstream(file) << kCampaign
                      << "[stop]\nmetric = \"nees\"\nstatistic = \"percentile\"\npercentile = "
                         "95\nhalf_width = 0.1\n";
  const std::string alone = scratch_folder() + "/stop1", four = scratch_folder() + "/stop4";
  ASSERT_EQ(run("campaign run " + file + " --quiet -o " + alone).exit_code, 0);
  ASSERT_EQ(shell(kMpi + "4 " + loxo::testing::program() + " campaign run " + file +
                  " --threads 1 -o " + four),
            0);
  EXPECT_LT(Store(alone).trials(), 300000u);
  expect_same_rows(alone, four);
}

TEST(CampaignRun, ARankKilledTakesNothingWithIt) {
  if (!have_mpi()) GTEST_SKIP() << "no MPI";
  const std::string store = scratch_folder() + "/rank_killed",
                    file = scratch_folder() + "/long.toml";
  std::string text = kCampaign;
  text.replace(text.find("300000"), 6, "3000000");
  std::ofstream(file) << text;
  const pid_t pid = start({"mpirun", "--oversubscribe", "-n", "3", loxo::testing::program(),
                           "campaign", "run", file, "--threads", "1", "-o", store});
  // Wait for a first segment of rank 1, then kill the process that its name tells.
  pid_t victim = 0;
  for (int i = 0; i < 400 && victim == 0; ++i) {
    ::usleep(20000);
    std::error_code ec;
    for (const auto& e : std::filesystem::directory_iterator(parts_folder(store), ec)) {
      const std::string name = e.path().stem().string();
      const auto number = name.rfind('-'), process = name.rfind('-', number - 1),
                 rank = name.rfind('-', process - 1);
      if (e.path().extension() == ".seg" && name.substr(rank + 1, process - rank - 1) == "1")
        victim =
            static_cast<pid_t>(std::atoi(name.substr(process + 1, number - process - 1).c_str()));
    }
  }
  ASSERT_GT(victim, 0);
  ::kill(victim, SIGKILL);
  int status = 0;
  ::waitpid(pid, &status, 0);
  EXPECT_FALSE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  // Finished by one process; compared with trials computed alone.
  ASSERT_EQ(run("campaign run " + file + " --quiet --trials 400000 -o " + store).exit_code, 0);
  const Store held(store);
  ASSERT_EQ(held.trials(), 400000u);
  const Campaign c = campaign_of(held.identity(), held.identity().version, store);
  for (std::uint64_t t = 0; t < 400000; t += 3331) EXPECT_EQ(held.row(t), run_trial(c, t)) << t;
}

TEST(CampaignRun, TwoMachinesGiveTheSameRows) {
  if (!have_mpi() || ::geteuid() != 0 ||
      std::system("command -v ip sqlite3 unshare >/dev/null 2>&1") != 0 ||
      std::system("unshare -n true 2>/dev/null && ip netns list >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "network namespaces need root, ip and sqlite3";
  const int code = shell(std::string("timeout 100 ") + loxo::testing::source_folder() +
                         "/tools/check_cluster " + loxo::testing::program());
  if (code == 77) GTEST_SKIP() << "no network namespaces here";
  EXPECT_EQ(code, 0) << loxo::testing::slurp(scratch_folder() + "/sh.err");
  EXPECT_NE(loxo::testing::slurp(scratch_folder() + "/sh.out").find("the same rows as one process"),
            std::string::npos);
}

TEST(CampaignRun, DifferentProgramsOrCampaignsOnTheRanksAreRefused) {
  if (!have_mpi()) GTEST_SKIP() << "no MPI";
  const std::string other = scratch_folder() + "/other_loxo";
  std::filesystem::copy_file(loxo::testing::program(), other,
                             std::filesystem::copy_options::overwrite_existing);
  std::ofstream(other, std::ios::app | std::ios::binary) << '\0';
  const std::string arguments =
      " campaign run " + campaign_file() + " -o " + scratch_folder() + "/mixed";
  EXPECT_EQ(
      shell(kMpi + "1 " + loxo::testing::program() + arguments + " : -n 1 " + other + arguments),
      3);
  EXPECT_NE(
      loxo::testing::slurp(scratch_folder() + "/sh.err").find("the ranks run different programs"),
      std::string::npos);
  EXPECT_EQ(shell(kMpi + "1 " + loxo::testing::program() + arguments + " : -n 1 " +
                  loxo::testing::program() + arguments + " --seed 99"),
            3);
  EXPECT_NE(loxo::testing::slurp(scratch_folder() + "/sh.err").find("different campaigns"),
            std::string::npos);
}

TEST(CampaignRun, AFullDiskLosesNothing) {
  const std::string store = scratch_folder() + "/full", file = campaign_file();
  const std::string command =
      std::string(loxo::testing::program()) + " campaign run " + file + " --quiet -o " + store;
  // The write path fails after 64 kB to 15 MB a file, as on a full disk (ulimit counts kilobytes in
  // bash). The last runs have computed all 41 MB, but cannot merge them.
  for (const char* limit : {"64", "1000", "8000", "15000", "15000", "15000", "15000"}) {
    EXPECT_EQ(shell("bash -c 'ulimit -f " + std::string(limit) + "; exec " + command + "'"), 1);
    const std::string err = loxo::testing::slurp(scratch_folder() + "/sh.err");
    EXPECT_NE(err.find("disk full"), std::string::npos) << err;
    EXPECT_NE(err.find("resumes"), std::string::npos) << err;
  }
  ASSERT_EQ(run("campaign run " + file + " --quiet -o " + store).exit_code, 0);
  expect_same_rows(store, undisturbed());
}

TEST(CampaignRun, CtrlCLeavesWhatCanBeResumed) {
  const std::string store = scratch_folder() + "/interrupted",
                    file = scratch_folder() + "/long2.toml";
  std::string text = kCampaign;
  text.replace(text.find("300000"), 6, "30000000");
  std::ofstream(file) << text;
  const pid_t pid = start({loxo::testing::program(), "campaign", "run", file, "-o", store});
  for (int i = 0; i < 200 && !has_parts(store); ++i) ::usleep(10000);
  ::usleep(150000);
  ::kill(pid, SIGINT);
  int status = 0;
  ::waitpid(pid, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 1);
  EXPECT_FALSE(std::filesystem::exists(store));
  // A report at any time, then the rest (here: fewer trials).
  const auto report = run("campaign report " + store + " --json");
  EXPECT_EQ(report.exit_code, 0) << report.err;
  EXPECT_NE(report.out.find("\"complete\": false"), std::string::npos);
  EXPECT_EQ(run("campaign run " + file + " --quiet --trials 20000 -o " + store).exit_code, 0);
  EXPECT_EQ(Store(store).trials(), 20000u);
}

TEST(CampaignRun, ReportReplayAndComparison) {
  const std::string store = undisturbed(), page = scratch_folder() + "/page.html";
  const auto report =
      run("campaign report " + store + " --json --worst 3 --metric nees -o " + page);
  ASSERT_EQ(report.exit_code, 0) << report.err;
  EXPECT_NE(report.out.find("\"replay\": \"loxo campaign replay " + store), std::string::npos);
  EXPECT_GT(std::filesystem::file_size(page), 10000u);
  const auto replay = run("campaign replay " + store + " --trial 4711 --json");
  EXPECT_EQ(replay.exit_code, 0);
  EXPECT_NE(replay.out.find("\"same_bits\": true"), std::string::npos);
  const std::string other = scratch_folder() + "/other";
  ASSERT_EQ(run("campaign run " + campaign_file() +
                " --quiet --trials 300000 --set 'parameters.benchmark_std=\"0.2 m\"' -o " + other)
                .exit_code,
            0);
  const auto compared = run("campaign report " + store + " --against " + other + " --json");
  EXPECT_NE(compared.out.find("\"paired\": true"), std::string::npos);
}

TEST(CampaignRun, GatesAreJudgedAndRequired) {
  const std::string file = scratch_folder() + "/gates.toml", store = scratch_folder() + "/gates";
  const auto write = [&](const char* gate) {
    std::ofstream(file) << "kind = \"two_point\"\ntrials = 256\nseed = 5\n" << gate;
  };
  // The mean of a normalised error squared is 2; half of that it cannot be.
  write(
      "[[gate]]\nname = \"consistency\"\nmetric = \"nees\"\nstatistic = \"mean\"\nexpected = "
      "2\nat_most = 1\n");
  ASSERT_EQ(run("campaign run " + file + " --quiet -o " + store).exit_code, 0);
  auto r = run("campaign report " + store);
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_NE(r.out.find("consistency"), std::string::npos) << r.out;
  EXPECT_NE(r.out.find("<= 1 MISSED"), std::string::npos) << r.out;
  r = run("campaign report " + store + " --require --json");
  EXPECT_EQ(r.exit_code, 4);
  EXPECT_NE(r.err.find("consistency"), std::string::npos) << r.err;
  EXPECT_NE(r.out.find("\"met\": false"), std::string::npos) << r.out;
  std::filesystem::remove(store);
  write("[[gate]]\nmetric = \"nees\"\nstatistic = \"mean\"\nat_most = 4\n");
  ASSERT_EQ(run("campaign run " + file + " --quiet -o " + store).exit_code, 0);
  EXPECT_EQ(run("campaign report " + store + " --require").exit_code, 0);
  std::filesystem::remove(store);
  write("");
  ASSERT_EQ(run("campaign run " + file + " --quiet -o " + store).exit_code, 0);
  r = run("campaign report " + store + " --require");
  EXPECT_EQ(r.exit_code, 3);
  EXPECT_NE(r.err.find("[[gate]]"), std::string::npos) << r.err;
  write("[[gate]]\nmetric = \"ness\"\n");
  r = run("campaign run " + file + " -o " + scratch_folder() + "/none");
  EXPECT_EQ(r.exit_code, 3);
  EXPECT_NE(r.err.find("gates.toml:5"), std::string::npos) << r.err;
  EXPECT_NE(r.err.find("did you mean 'nees'"), std::string::npos) << r.err;
}

TEST(CampaignRun, BadInputIsNamed) {
  const auto refused = [](const std::string& arguments, int code, const std::string& words) {
    const auto r = run("campaign " + arguments);
    EXPECT_EQ(r.exit_code, code) << arguments << "\n" << r.err;
    EXPECT_NE(r.err.find(words), std::string::npos) << arguments << "\n" << r.err;
    EXPECT_TRUE(r.out.empty()) << r.out;
  };
  const std::string file = campaign_file(), somewhere = scratch_folder() + "/x";
  refused("run leg-lenght -o " + somewhere, 3, "did you mean 'leg-length'");
  refused("run " + file, 2, "-o STORE");
  refused("run " + file + " -o " + scratch_folder() + "/no/such/store", 1, "no folder");
  refused("run " + file + " -o " + somewhere + " --set parameters.lenght=3", 3,
          "did you mean 'length'");
  refused("run " + file + " -o " + somewhere + " --set stop.metric='\"ness\"'", 3,
          "did you mean 'nees'");
  refused("run " + file + " -o " + somewhere +
              " --set 'parameters.length={normal=[\"1 km\",\"-1 m\"]}'",
          3, "negative sigma");
  refused("run " + file + " -o " + undisturbed() + " --seed 77", 3, "seed 5, found seed 77");
  refused("report " + somewhere, 3, "no such campaign store");
  refused("report " + file, 3, "not a campaign store");
  refused("report " + undisturbed() + " --metric ness", 2, "did you mean 'nees'");
  refused("replay " + undisturbed() + " --trial 300000", 3, "from 0 to 299999");
  refused("", 2, "run, report, replay");
  // Root may write everywhere: a file where the folder should be stands for a store that is not
  // writable.
  std::ofstream(somewhere + "2.parts") << "in the way";
  refused("run " + file + " -o " + somewhere + "2", 1, "not writable");
}

}  // namespace
