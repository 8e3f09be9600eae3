// SPDX-License-Identifier: Apache-2.0
// `loxo convert SRC DST`: drives, tables and solutions from one form to another.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "cli/command.hpp"
#include "loxo/log/convert.hpp"
#include "loxo/num/error.hpp"

namespace loxo::cli {
namespace {

struct Options {
  std::string from, to, table;
};

bool is_table_name(const std::string& path) {
  return path == "-" || path.ends_with(".csv") || path.ends_with(".csv.gz") ||
         path.ends_with(".h5");
}

int convert(const Globals& globals, const Options& o) {
  namespace fs = std::filesystem;
  const std::string to = o.to.empty() ? globals.output : o.to;
  if (to.empty())
    throw Error(ErrorKind::kUsage, "expected where to write: loxo convert SRC DST", "DST");
  if (to == "-" && globals.json)
    throw Error(ErrorKind::kUsage, "standard output cannot take the table and --json", "DST");
  std::error_code failed;
  if (o.from != "-" && fs::equivalent(o.from, to, failed))
    throw Error(ErrorKind::kUsage, "is the source itself", to);
  Diagnostics diagnostics;
  Converted done;
  Progress progress(globals, "rows", 0);
  const auto told = [&](std::size_t rows) { progress.at(static_cast<double>(rows)); };
  std::string kind = "table";
  if (o.from != "-" && is_drive(o.from)) {
    kind = "drive";
    if (!o.table.empty())
      throw Error(ErrorKind::kUsage, "a drive goes over whole; --table is for tables", "--table");
    if (is_table_name(to) && !to.ends_with(".h5"))
      throw Error(ErrorKind::kUsage, "a drive becomes one .h5 file or a folder; found '" + to + "'",
                  "DST");
    const Drive drive = read_drive(o.from, globals.sets);
    diagnostics = drive.diagnostics;
    done = convert_drive(drive, to, diagnostics, told);
  } else {
    if (!is_table_name(to))
      throw Error(ErrorKind::kUsage,
                  "a table becomes .csv, .csv.gz, .h5 or - (standard output); found '" + to + "'",
                  "DST");
    done = convert_table(o.from, o.table, to, diagnostics, told);
  }
  print_diagnostics(globals, diagnostics);
  if (globals.json) {
    Json j;
    j["command"] = "convert";
    j["kind"] = kind;
    j["from"] = o.from;
    j["to"] = to;
    j["tables"] = done.tables;
    j["rows"] = done.rows;
    j["diagnostics"] = to_json(diagnostics);
    print_json(j);
  } else if (to != "-") {
    say(globals, fmt::format("{}: {} table{}, {} rows", to, done.tables,
                             done.tables == 1 ? "" : "s", done.rows));
  }
  return 0;
}

}  // namespace

void add_convert(CLI::App& app, Globals& globals) {
  auto o = std::make_shared<Options>();
  auto* sub = add_command(app, globals, "convert",
                          "a drive, a table or a solution in another form: folder, CSV, HDF5",
                          "loxo convert examples/drives/kingston2008_a kingston.h5",
                          [&globals, o] { return convert(globals, *o); });
  sub->add_option("SRC", o->from,
                  "a drive (folder, .toml, .h5), or a table in any format that inspect knows")
      ->required();
  sub->add_option("DST", o->to, "a .h5 file, a .csv or .csv.gz, or the folder of a drive");
  sub->add_option("--table", o->table, "which of several tables in SRC");
}

}  // namespace loxo::cli
