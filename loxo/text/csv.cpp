// SPDX-License-Identifier: Apache-2.0
#include "loxo/text/csv.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "loxo/num/error.hpp"
#include "loxo/text/gzip.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo {
namespace {

constexpr std::size_t kBuffer = 1u << 20;
constexpr std::size_t kLongestLine = 1u << 26;

bool blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

std::string_view trim(std::string_view s) {
  while (!s.empty() && blank(s.front())) s.remove_prefix(1);
  while (!s.empty() && blank(s.back())) s.remove_suffix(1);
  return s;
}

bool is_number(std::string_view s) {
  s = trim(s);
  if (!s.empty() && s.front() == '+') s.remove_prefix(1);
  double x = 0;
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), x);
  return !s.empty() && error == std::errc() && end == s.data() + s.size();
}

// Valid UTF-8 without control characters.
bool is_text(std::string_view s) {
  for (std::size_t i = 0; i < s.size();) {
    const auto c = static_cast<unsigned char>(s[i]);
    if (c < 0x20 && c != '\t' && c != '\r' && c != '\n') return false;
    const std::size_t more = c < 0x80         ? 0
                             : (c >> 5) == 6  ? 1
                             : (c >> 4) == 14 ? 2
                             : (c >> 3) == 30 ? 3
                                              : 9;
    if (more == 9 || i + more >= s.size() + (more == 0 ? 1 : 0)) return false;
    for (std::size_t k = 1; k <= more; ++k) {
      if ((static_cast<unsigned char>(s[i + k]) >> 6) != 2) return false;
    }
    i += more + 1;
  }
  return true;
}

std::string shortened(std::string_view s) {
  std::string text(s.substr(0, 40));
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20) c = '?';
  }
  return s.size() > 40 ? text + "…" : text;
}

}  // namespace

struct CsvReader::Impl {
  ByteSource source;
  std::string path;
  std::vector<std::string> header;
  std::map<std::string, std::string> meta;
  std::vector<int> slot;  // column -> place in the row, -1: not chosen
  std::size_t chosen = 0, last_chosen = 0;
  char delimiter = ',';

  std::vector<char> buffer;
  std::size_t at = 0, end = 0;  // unread bytes are [at, end)
  bool source_end = false, fault_told = false;

  std::size_t line = 0, rows = 0;
  char* row_begin = nullptr;
  char* row_end = nullptr;
  bool is_split = false;
  std::vector<std::string_view> cells;
  std::string pending;  // a first data row that was read in search of the header
  bool has_pending = false;

  explicit Impl(const std::string& p)
      : source(p), path(p == "-" ? "standard input" : p), buffer(kBuffer) {}

  bool refill() {
    if (source_end) return false;
    if (at > 0) {
      std::memmove(buffer.data(), buffer.data() + at, end - at);
      end -= at;
      at = 0;
    }
    if (end == buffer.size()) {
      if (buffer.size() >= kLongestLine) {
        throw Error(ErrorKind::kInput, "a line of more than 64 MB: not a CSV file",
                    path + ":" + std::to_string(line + 1));
      }
      buffer.resize(2 * buffer.size());
    }
    const std::size_t got = source.read(buffer.data() + end, buffer.size() - end);
    end += got;
    source_end = got == 0;
    return got > 0;
  }

  // The next line without its end; false at the end of the file. The last line of a broken gzip
  // stream is cut off somewhere: it is not given.
  bool next_line(char*& b, char*& e) {
    std::size_t searched = at;
    for (;;) {
      char* found = static_cast<char*>(std::memchr(buffer.data() + searched, '\n', end - searched));
      if (found != nullptr) {
        b = buffer.data() + at;
        e = found;
        at = static_cast<std::size_t>(found - buffer.data()) + 1;
        break;
      }
      const std::size_t unread = end - at;
      if (!refill()) {
        if (at == end || !source.fault().empty()) return false;
        b = buffer.data() + at;
        e = buffer.data() + end;
        at = end;
        break;
      }
      searched = at + unread;
    }
    ++line;
    if (e > b && e[-1] == '\r') --e;
    return true;
  }

  std::string where() const { return path + ":" + std::to_string(line); }

  // Cells of [b, e), quotes taken off in place. False: a quote that is not closed or has text after
  // it.
  bool split(char* b, char* e, std::vector<std::string_view>& out) const {
    out.clear();
    for (char* p = b;;) {
      char* q = p;
      while (q < e && (*q == ' ' || (*q == '\t' && delimiter != '\t'))) ++q;
      if (q < e && *q == '"') {
        char* to = ++q;
        char* const from = to;
        for (; q < e; ++q) {
          if (*q == '"') {
            if (q + 1 < e && q[1] == '"') {
              ++q;
            } else {
              break;
            }
          }
          *to++ = *q;
        }
        if (q == e) return false;
        ++q;
        while (q < e && (*q == ' ' || *q == '\r')) ++q;
        out.emplace_back(from, static_cast<std::size_t>(to - from));
        if (q == e) return true;
        if (*q != delimiter) return false;
        p = q + 1;
      } else {
        char* comma =
            static_cast<char*>(std::memchr(p, delimiter, static_cast<std::size_t>(e - p)));
        char* stop = comma != nullptr ? comma : e;
        out.push_back(trim({p, static_cast<std::size_t>(stop - p)}));
        if (comma == nullptr) return true;
        p = comma + 1;
      }
    }
  }

  void read_header() {
    refill();
    while (end < 4096 && refill()) {
    }
    const std::string_view front(buffer.data(), end);
    if (front.empty()) {
      throw Error(ErrorKind::kInput,
                  source.fault().empty() ? "empty file; expected a CSV header"
                                         : source.fault() + " before its first line",
                  path);
    }
    if (front.substr(0, 2) == "\xff\xfe" || front.substr(0, 2) == "\xfe\xff") {
      throw Error(ErrorKind::kInput, "UTF-16 text; expected UTF-8", path);
    }
    if (const auto nul = front.find('\0'); nul != std::string_view::npos) {
      throw Error(
          ErrorKind::kInput,
          "binary file (a NUL byte at offset " + std::to_string(nul) + "); expected CSV text",
          path);
    }
    if (front.substr(0, 3) == "\xef\xbb\xbf") at = 3;

    char *b = nullptr, *e = nullptr;
    std::string comment;  // the last comment line, which may turn out to be the header
    std::size_t comment_line = 0;
    for (;;) {
      if (!next_line(b, e)) {
        throw Error(ErrorKind::kInput,
                    std::string("no header: the file holds no line of column names") +
                        (source.fault().empty() ? std::string() : " and " + source.fault()),
                    path);
      }
      const std::string_view text = trim({b, static_cast<std::size_t>(e - b)});
      if (text.empty()) continue;
      if (text.front() != '#') break;
      comment = trim(text.substr(1));
      comment_line = line;
      if (const auto colon = comment.find(':'); colon != std::string::npos) {
        meta[std::string(trim(std::string_view(comment).substr(0, colon)))] =
            trim(std::string_view(comment).substr(colon + 1));
      }
    }
    std::string first(b, e);
    if (!is_text(first)) {
      throw Error(ErrorKind::kInput,
                  "not text (neither ASCII nor UTF-8 in the header); expected CSV", where());
    }
    choose_delimiter(first);
    std::string row = first;
    if (!split(row.data(), row.data() + row.size(), cells)) {
      throw Error(ErrorKind::kInput, "a quote that is not closed in the header", where());
    }
    if (std::all_of(cells.begin(), cells.end(), is_number)) {
      // "#time,x,y" above the numbers is a header all the same.
      const std::size_t n = cells.size();
      std::vector<std::string_view> names;
      std::string copy = comment;
      if (n > 1 && split(copy.data(), copy.data() + copy.size(), names) && names.size() == n &&
          std::none_of(names.begin(), names.end(), is_number)) {
        header.assign(names.begin(), names.end());
        meta.erase(comment.substr(0, std::min(comment.find(':'), comment.size())));
        pending = first;
        has_pending = true;
        --line;
        static_cast<void>(comment_line);
      } else {
        throw Error(ErrorKind::kInput,
                    "no header: the first row is all numbers ('" + shortened(first) +
                        "'); expected a row of column names",
                    where());
      }
    } else {
      header.assign(cells.begin(), cells.end());
    }
    cells.clear();
    slot.assign(header.size(), 0);
    for (std::size_t i = 0; i < header.size(); ++i) slot[i] = static_cast<int>(i);
    chosen = header.size();
  }

  void choose_delimiter(std::string_view line) {
    std::string text;  // outside of quotes
    bool quoted = false;
    for (const char c : line) {
      if (c == '"')
        quoted = !quoted;
      else if (!quoted)
        text += c;
    }
    if (text.find(',') != std::string_view::npos) return;
    if (text.find(';') != std::string_view::npos) {
      delimiter = ';';
    } else if (text.find('\t') != std::string_view::npos) {
      delimiter = '\t';
    }
  }

  // The next data row as [row_begin, row_end); blank and comment lines are passed over.
  bool next_row(Diagnostics* diagnostics) {
    is_split = false;
    if (has_pending) {
      has_pending = false;
      row_begin = pending.data();
      row_end = pending.data() + pending.size();
      ++line;
      ++rows;
      return true;
    }
    for (;;) {
      if (!next_line(row_begin, row_end)) {
        row_begin = row_end = nullptr;
        if (diagnostics != nullptr && !fault_told && !source.fault().empty()) {
          fault_told = true;
          diagnostics->bad("truncated", where(),
                           "the file " + source.fault() + "; the " + std::to_string(rows) +
                               " rows before are kept");
        }
        return false;
      }
      if (row_begin == row_end || *row_begin == '#') continue;
      if (blank(*row_begin) &&
          trim({row_begin, static_cast<std::size_t>(row_end - row_begin)}).empty())
        continue;
      ++rows;
      return true;
    }
  }

  std::string cell_where(const char* p) const {
    return where() + ":" + std::to_string(p - row_begin + 1);
  }
  std::string not_number(std::size_t column, std::string_view cell) const {
    return "expected a number in column '" + header[column] + "', found '" + shortened(cell) +
           "'; row skipped";
  }
  std::string wrong_count(std::size_t found) const {
    return "expected " + std::to_string(header.size()) + " cells, found " + std::to_string(found) +
           "; row skipped";
  }

  // A cell that from_chars cannot take as it stands: quoted, empty, "+1", "NaN". False: not a
  // number.
  static bool odd_number(std::string_view cell, double& x) {
    cell = trim(cell);
    if (cell.empty()) {
      x = std::nan("");
      return true;
    }
    if (cell.front() == '+') cell.remove_prefix(1);
    if (cell.empty()) return false;
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), x);
    if (error == std::errc::result_out_of_range && end == cell.data() + cell.size()) {
      // Too small reads as zero; too large is no number to compute with.
      x = std::strtod(std::string(cell).c_str(), nullptr);
      return std::isfinite(x);
    }
    return error == std::errc() && end == cell.data() + cell.size() && !std::isinf(x);
  }

  bool slow_row(std::span<double> row, Diagnostics& diagnostics) {
    if (!split(row_begin, row_end, cells)) {
      diagnostics.bad("bad_row", where(), "a quote that is not closed; row skipped");
      return false;
    }
    is_split = true;
    if (cells.size() != header.size()) {
      diagnostics.bad("bad_row", where(), wrong_count(cells.size()));
      return false;
    }
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (slot[i] < 0) continue;
      if (!odd_number(cells[i], row[static_cast<std::size_t>(slot[i])])) {
        diagnostics.bad("bad_row", cell_where(cells[i].data()), not_number(i, cells[i]));
        return false;
      }
    }
    return true;
  }

  // One pass: from_chars stops at the delimiter, so that no cell is looked at twice.
  bool fast_row(std::span<double> row, Diagnostics& diagnostics) {
    const char* p = row_begin;
    const char* const e = row_end;
    const std::size_t n = header.size();
    for (std::size_t i = 0; i < n; ++i) {
      const int s = slot[i];
      if (s >= 0) {
        double& x = row[static_cast<std::size_t>(s)];
        const auto [q, error] = std::from_chars(p, e, x);
        if (error == std::errc() && (q == e || *q == delimiter) && !(std::isinf(x))) {
          p = q;
        } else {
          const char* stop =
              static_cast<const char*>(std::memchr(p, delimiter, static_cast<std::size_t>(e - p)));
          if (stop == nullptr) stop = e;
          const std::string_view cell(p, static_cast<std::size_t>(stop - p));
          if (cell.find('"') != std::string_view::npos) return slow_row(row, diagnostics);
          if (!odd_number(cell, x)) {
            diagnostics.bad("bad_row", cell_where(p), not_number(i, trim(cell)));
            return false;
          }
          p = stop;
        }
      } else {
        if (p < e && *p == '"') return slow_row(row, diagnostics);
        while (p < e && *p != delimiter) {
          if (*p == '"') return slow_row(row, diagnostics);
          ++p;
        }
      }
      if (i + 1 < n) {
        if (p == e) {
          diagnostics.bad("bad_row", where(), wrong_count(i + 1));
          return false;
        }
        ++p;
      }
    }
    if (p != e) {
      std::size_t found = n;
      for (; p < e; ++p) found += *p == delimiter ? 1 : 0;
      diagnostics.bad("bad_row", where(), wrong_count(found));
      return false;
    }
    return true;
  }
};

CsvReader::CsvReader(const std::string& path) : impl_(std::make_unique<Impl>(path)) {
  impl_->read_header();
}
CsvReader::~CsvReader() = default;
CsvReader::CsvReader(CsvReader&&) noexcept = default;
CsvReader& CsvReader::operator=(CsvReader&&) noexcept = default;

const std::string& CsvReader::path() const { return impl_->path; }
const std::vector<std::string>& CsvReader::header() const { return impl_->header; }
const std::map<std::string, std::string>& CsvReader::meta() const { return impl_->meta; }
bool CsvReader::has(std::string_view column) const {
  return std::find(impl_->header.begin(), impl_->header.end(), column) != impl_->header.end();
}
std::size_t CsvReader::index(std::string_view column) const {
  const auto& h = impl_->header;
  const auto it = std::find(h.begin(), h.end(), column);
  if (it == h.end()) {
    std::string found;
    for (std::size_t i = 0; i < h.size(); ++i) {
      if (i == 24) {
        found += ", …";
        break;
      }
      found += (i > 0 ? ", " : "") + h[i];
    }
    const std::string near = nearest(column, h);
    throw Error(ErrorKind::kInput,
                "no column '" + std::string(column) + "'; found: " + found +
                    (near.empty() ? "" : "; did you mean '" + near + "'?"),
                path());
  }
  if (std::find(it + 1, h.end(), column) != h.end()) {
    throw Error(ErrorKind::kInput, "two columns are named '" + std::string(column) + "'", path());
  }
  return static_cast<std::size_t>(it - h.begin());
}

void CsvReader::select(const std::vector<std::string>& columns) {
  impl_->slot.assign(impl_->header.size(), -1);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    int& s = impl_->slot[index(columns[i])];
    if (s >= 0)
      throw Error(ErrorKind::kInput, "column '" + columns[i] + "' is named twice", path());
    s = static_cast<int>(i);
  }
  impl_->chosen = columns.size();
}

bool CsvReader::next(std::span<double> row, Diagnostics& diagnostics) {
  Impl& s = *impl_;
  if (row.size() < s.chosen)
    throw Error(ErrorKind::kWork, "a row of too few numbers was given to the CSV reader", s.path);
  while (s.next_row(&diagnostics)) {
    if (s.fast_row(row, diagnostics)) return true;
  }
  return false;
}

bool CsvReader::next_text(std::vector<std::string_view>& cells) {
  Impl& s = *impl_;
  if (!s.next_row(nullptr)) return false;
  if (!s.split(s.row_begin, s.row_end, s.cells)) s.cells.clear();
  s.is_split = true;
  cells = s.cells;
  return true;
}

const std::vector<std::string_view>& CsvReader::cells() const {
  Impl& s = *impl_;
  if (!s.is_split) {
    s.cells.clear();
    if (s.row_begin != nullptr && !s.split(s.row_begin, s.row_end, s.cells)) s.cells.clear();
    s.is_split = true;
  }
  return s.cells;
}
std::size_t CsvReader::line() const { return impl_->line; }
std::size_t CsvReader::rows() const { return impl_->rows; }

void append_number(std::string& out, double x) {
  if (std::isnan(x)) {
    out += "nan";
    return;
  }
  char text[40];
  const auto r = std::to_chars(text, text + sizeof text, x);
  out.append(text, r.ptr);
}
void append_number(std::string& out, double x, int precision) {
  if (precision <= 0 || std::isnan(x)) {
    append_number(out, x);
    return;
  }
  char text[400];
  const auto r = std::to_chars(text, text + sizeof text, x, std::chars_format::general,
                               std::min(precision, 300));
  out.append(text, r.ptr);
}

}  // namespace loxo
