// SPDX-License-Identifier: Apache-2.0
#include "cli/table.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iostream>
#include <limits>
#include <optional>

#include "loxo/num/error.hpp"
#include "loxo/text/csv.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo::cli {
namespace {

// A number as people and programs write it: blanks around, a plus sign; nothing else after it.
std::optional<double> number(std::string_view s) {
  const auto blank = [](char c) { return c == ' ' || c == '\t'; };
  while (!s.empty() && blank(s.front())) s.remove_prefix(1);
  while (!s.empty() && blank(s.back())) s.remove_suffix(1);
  if (s.size() > 1 && s.front() == '+' && s[1] != '-') s.remove_prefix(1);
  double x = 0;
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), x);
  if (s.empty() || error != std::errc() || end != s.data() + s.size()) return std::nullopt;
  return x;
}

void append_cell(std::string& out, std::string_view cell) {
  if (cell.find_first_of(",\"\n") == std::string_view::npos) {
    out += cell;
    return;
  }
  out += '"';
  for (const char c : cell) {
    if (c == '"') out += '"';
    out += c;
  }
  out += '"';
}

std::string shown(std::string_view cell) {
  return "'" + std::string(cell.substr(0, 40)) + (cell.size() > 40 ? "…'" : "'");
}

// Bad rows on standard error: each with its line, up to a limit that no person reads beyond.
class BadRows {
 public:
  explicit BadRows(bool quiet) : quiet_(quiet) {}
  void add(const std::string& where, const std::string& what) {
    if (++count_ == 1) first_ = where + ": " + what;
    if (!quiet_ && count_ <= kShown) std::cerr << "bad: " << where << ": " << what << '\n';
  }
  void close() const {
    if (!quiet_ && count_ > kShown) std::cerr << "bad: " << count_ - kShown << " more rows\n";
  }
  std::size_t count() const { return count_; }
  const std::string& first() const { return first_; }

 private:
  static constexpr std::size_t kShown = 1000;
  bool quiet_;
  std::size_t count_ = 0;
  std::string first_;
};

}  // namespace

bool TableHeader::has(const std::string& name) const {
  return std::find(names_.begin(), names_.end(), name) != names_.end();
}

std::string bad_latitude(const char* column, double deg) {
  if (std::fabs(deg) <= 90.0) return {};
  std::string s = std::string(column) + ": expected a latitude within -90 to 90, found ";
  append_number(s, deg);
  return s;
}
std::string bad_longitude(const char* column, double deg) {
  if (std::fabs(deg) <= 360.0) return {};
  std::string s = std::string(column) + ": expected a longitude within -360 to 360, found ";
  append_number(s, deg);
  return s;
}

int run_table(const Globals& globals, const std::string& command, const std::string& path,
              const std::function<TableJob(const TableHeader&)>& plan) {
  CsvReader reader(path.empty() ? "-" : path);
  const std::string file = reader.path() == "-" ? "standard input" : reader.path();
  const std::vector<std::string>& header = reader.header();
  const TableJob job = plan(TableHeader(header));

  std::vector<std::size_t> from;
  for (const auto& name : job.inputs) from.push_back(reader.index(name));
  // Where each output goes: a column of its own, or the one that has its name already.
  std::vector<std::string> names = header;
  std::vector<std::size_t> to;
  for (const auto& name : job.outputs) {
    const auto found = std::find(names.begin(), names.end(), name);
    to.push_back(static_cast<std::size_t>(found - names.begin()));
    if (found == names.end()) {
      names.push_back(name);
    } else if (!globals.quiet && to.back() < header.size()) {
      std::cerr << "note: " << file << ": column " << name << " was there and is replaced\n";
    }
  }

  std::optional<OutputFile> out;
  Json rows = Json::array();
  if (!globals.json || !globals.output.empty())
    out.emplace(globals.output.empty() ? "-" : globals.output);
  std::string text;
  if (out) {
    for (const auto& [key, value] : reader.meta()) text += "# " + key + ": " + value + "\n";
    for (std::size_t j = 0; j < names.size(); ++j) {
      if (j > 0) text += ',';
      append_cell(text, names[j]);
    }
    text += '\n';
  }

  std::vector<std::string_view> cells;
  std::vector<double> in(job.inputs.size()), result(job.outputs.size());
  std::vector<std::string> written(names.size());
  BadRows bad(globals.quiet);
  std::size_t good = 0, count = 0;
  while (reader.next_text(cells)) {
    ++count;
    std::string reason;
    if (cells.size() != header.size()) {
      reason = cells.empty() ? "quotes that do not close"
                             : "expected " + std::to_string(header.size()) + " cells, found " +
                                   std::to_string(cells.size());
    }
    for (std::size_t i = 0; i < from.size() && reason.empty(); ++i) {
      const std::optional<double> x = number(cells[from[i]]);
      if (x && std::isfinite(*x)) {
        in[i] = *x;
      } else {
        reason = job.inputs[i] + ": expected a finite number, found " + shown(cells[from[i]]);
      }
    }
    std::fill(result.begin(), result.end(), std::numeric_limits<double>::quiet_NaN());
    if (reason.empty()) {
      reason = job.row(in, result);
      for (std::size_t i = 0; i < result.size() && reason.empty(); ++i) {
        if (!std::isfinite(result[i])) reason = job.outputs[i] + ": not defined here";
      }
    }
    const auto defined = [](double x) { return std::isfinite(x); };
    if (reason.empty() || (job.partial && std::any_of(result.begin(), result.end(), defined))) {
      if (!reason.empty()) bad.add(file + ":" + std::to_string(reader.line()), reason);
      ++good;
    } else {
      std::fill(result.begin(), result.end(), std::numeric_limits<double>::quiet_NaN());
      bad.add(file + ":" + std::to_string(reader.line()), reason);
    }

    for (std::size_t j = 0; j < names.size(); ++j) {
      written[j].clear();
      if (j < header.size() && j < cells.size()) written[j] = cells[j];
    }
    for (std::size_t i = 0; i < to.size(); ++i) {
      written[to[i]].clear();
      append_number(written[to[i]], result[i]);
    }
    if (out) {
      for (std::size_t j = 0; j < names.size(); ++j) {
        if (j > 0) text += ',';
        append_cell(text, written[j]);
      }
      text += '\n';
      if (text.size() > (1u << 16)) {
        out->write(text);
        text.clear();
      }
    }
    if (globals.json) {
      Json row = Json::object();
      for (std::size_t j = 0; j < names.size(); ++j) {
        const std::optional<double> x = number(written[j]);
        if (x)
          row[names[j]] = *x;
        else
          row[names[j]] = written[j];
      }
      rows.push_back(std::move(row));
    }
  }
  bad.close();
  if (good == 0 && out && globals.output.empty() && count > 0) {
    out->write(text);  // the rows with their nan, for who looks; a file would not appear
    out->commit();
  }
  if (good == 0) {
    throw Error(ErrorKind::kInput,
                count == 0 ? "no rows below the header"
                           : "no row could be computed; the first: " + bad.first(),
                count == 0 ? file : std::string());
  }
  if (out) {
    out->write(text);
    out->commit();
  }
  if (globals.json) {
    print_json({{"command", command},
                {"rows", std::move(rows)},
                {"rows_computed", good},
                {"rows_bad", bad.count()}});
  }
  return 0;
}

}  // namespace loxo::cli
