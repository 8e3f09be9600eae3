// SPDX-License-Identifier: Apache-2.0
// `loxo reproduce`: the printed values of the papers beside ours.
#include <fmt/format.h>

#include <exception>
#include <filesystem>
#include <memory>
#include <mutex>
#include <numeric>
#include <thread>

#include "cli/command.hpp"
#include "loxo/num/error.hpp"
#include "loxo/papers/reproduce.hpp"
#include "loxo/report/page_html.hpp"
#include "loxo/text/csv.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo::cli {
namespace {

using papers::Kind;
using papers::Paper;

struct ReproduceOptions {
  std::vector<std::string> papers;
  bool full = false, list = false, docs = false, errata = false;
  int threads = 0, runs = 0;
};

std::vector<const papers::PaperInfo*> chosen(const ReproduceOptions& o) {
  std::vector<std::string> names;
  for (const auto& p : papers::papers()) names.emplace_back(p.name);
  for (const auto& name : o.papers)
    if (std::find(names.begin(), names.end(), name) == names.end()) {
      std::string all;
      for (const auto& n : names) all += (all.empty() ? "" : ", ") + n;
      throw Error(ErrorKind::kUsage,
                  "no paper '" + name + "'" + suggestion(name, names) + "; there are: " + all,
                  "PAPER");
    }
  std::vector<const papers::PaperInfo*> out;
  for (const auto& p : papers::papers())
    if (o.papers.empty() || std::find(o.papers.begin(), o.papers.end(), p.name) != o.papers.end())
      out.push_back(&p);
  return out;
}

std::string printed(const papers::Claim& c) {
  if (c.kind == Kind::kFigure) return "-";
  const char* relation = c.kind == Kind::kAtMost ? "<= " : c.kind == Kind::kAtLeast ? ">= " : "";
  return relation + fmt::format("{:.6g}", c.printed);
}

// Printed values and what failed always; the rest with -v.
void say_table(const Globals& globals, const Paper& paper) {
  int count[3] = {0, 0, 0}, hidden = 0;
  say(globals, fmt::format("\n{}: {}", paper.name, paper.title));
  say(globals, fmt::format("  {:<34} {:>12} {:>13}  {:<10}  {}", "id", "printed", "ours", "verdict",
                           "quantity"));
  for (const auto& c : paper.checks) {
    ++count[static_cast<int>(c.verdict)];
    if (c.claim.kind == Kind::kFigure && c.verdict != papers::Verdict::kFailed &&
        !globals.verbose) {
      ++hidden;
      continue;
    }
    std::string what = c.claim.quantity;
    if (!globals.verbose && what.size() > 60) what = what.substr(0, 57) + "...";
    say(globals, fmt::format("  {:<34} {:>12} {:>13.6g}  {:<10}  {}", c.claim.id, printed(c.claim),
                             c.ours, papers::verdict_name(c.verdict), what));
    if (c.verdict == papers::Verdict::kFailed || globals.verbose ||
        c.verdict == papers::Verdict::kCorrected)
      if (!c.note.empty()) say(globals, "      " + c.note);
  }
  if (hidden > 0)
    say(globals,
        fmt::format("  and {} more without a printed number, all as derived (-v lists them)",
                    hidden));
  say(globals,
      fmt::format("  {} reproduced, {} corrected, {} failed", count[0], count[1], count[2]));
}

void write_all(const std::vector<Paper>& done, const std::string& folder,
               const std::string& command) {
  std::error_code why;
  std::filesystem::create_directories(folder, why);
  if (why) throw Error(ErrorKind::kWork, "the folder cannot be made: " + why.message(), folder);
  auto page = papers::report_page(done);
  page.provenance = {{"program", std::string("loxo ") + LOXO_VERSION}, {"command", command}};
  report::write_page(page, folder + "/report.html");
  const auto put = [&](const std::string& name, const std::string& text) {
    OutputFile file(folder + "/" + name);
    file.write(text);
    file.commit();
  };
  put("checks.json", dump_json(papers::to_json(done)) + "\n");
  for (const auto& paper : done)
    for (const auto& f : paper.figures)
      put(paper.name + "-" + f.id + ".csv", papers::figure_csv(f));
}

int run_reproduce(const Globals& globals, const ReproduceOptions& o) {
  const auto list = chosen(o);
  if (o.errata) {
    fmt::print("{}", papers::errata_page());
    return 0;
  }
  if (o.threads < 0 || o.runs < 0)
    throw Error(ErrorKind::kUsage, "a number, 0 for the standard one, expected",
                o.threads < 0 ? "--threads" : "--runs");
  if (globals.output == "-")
    throw Error(ErrorKind::kUsage, "a folder expected: a page and a CSV for each figure", "-o");
  double total = 0;
  for (const auto* p : list) total += p->cost;
  std::vector<Paper> done(list.size());
  {
    Progress progress(globals, "reproduce", total);
    std::mutex lock;
    std::vector<double> share(list.size(), 0.0);
    const auto one = [&](std::size_t i) {
      papers::Options options;
      options.full = o.full;
      options.threads = o.threads;
      options.runs = o.runs;
      options.seed = globals.seed;
      options.progress = [&, i](double x) {
        const std::lock_guard<std::mutex> held(lock);
        share[i] = x * list[i]->cost;
        progress.at(std::accumulate(share.begin(), share.end(), 0.0));
      };
      done[i] = list[i]->run(options);
    };
    // The one paper that takes most of the time keeps this thread and its helpers busy; the others
    // have stretches for one thread only, and run beside it.
    std::size_t longest = 0;
    for (std::size_t i = 1; i < list.size(); ++i)
      if (list[i]->cost > list[longest]->cost) longest = i;
    std::exception_ptr failure;
    const auto others = [&] {
      try {
        for (std::size_t i = 0; i < list.size(); ++i)
          if (i != longest) one(i);
      } catch (...) {
        failure = std::current_exception();
      }
    };
    if (o.threads == 1) {
      others();
      if (!failure) one(longest);
    } else {
      std::thread beside(others);
      try {
        one(longest);
      } catch (...) {
        beside.join();
        throw;
      }
      beside.join();
    }
    if (failure) std::rethrow_exception(failure);
  }
  if (o.docs) {
    fmt::print("{}", papers::docs_page(done));
  } else if (globals.json) {
    print_json(papers::to_json(done));
  } else {
    for (const auto& paper : done) say_table(globals, paper);
  }
  int failed = 0, all = 0;
  for (const auto& paper : done)
    for (const auto& c : paper.checks) ++all, failed += c.verdict == papers::Verdict::kFailed;
  if (!globals.output.empty()) {
    std::string command = "loxo reproduce";
    for (const auto& p : o.papers) command += " " + p;
    if (o.full) command += " --full";
    write_all(done, globals.output, command);
    if (!o.docs) say(globals, fmt::format("\nreport: {}/report.html", globals.output));
  }
  if (failed == 0) {
    if (!o.docs) say(globals, fmt::format("\n{} checks, none failed", all));
    return 0;
  }
  if (!o.docs) say(globals, fmt::format("\n{} checks, {} failed", all, failed));
  return static_cast<int>(ErrorKind::kRequirement);
}

}  // namespace

void add_reproduce(CLI::App& app, Globals& globals) {
  auto o = std::make_shared<ReproduceOptions>();
  auto* sub = add_command(app, globals, "reproduce",
                          "every table and figure of the papers: printed value, ours, verdict",
                          "loxo reproduce yu2023 -o out",
                          [&globals, o] { return run_reproduce(globals, *o); });
  sub->add_option("PAPER", o->papers, "yu2023, shi2015, wang2012, liu2014, bian2022; none: all");
  sub->add_flag("--full", o->full, "the longer studies: 400 Monte Carlo runs a route");
  sub->add_option("--runs", o->runs, "Monte Carlo runs a route (0: 100, with --full 400)");
  sub->add_option("--threads", o->threads, "threads (0: all); the results do not depend on it");
  sub->add_flag("--docs", o->docs, "print docs/papers.md instead of the table");
  sub->add_flag("--errata", o->errata, "print the papers' errata as a Markdown table");
}

}  // namespace loxo::cli
