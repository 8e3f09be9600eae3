// SPDX-License-Identifier: Apache-2.0
#include "loxo/log/convert.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <regex>
#include <set>

#include "loxo/log/channel.hpp"
#include "loxo/log/hdf5_file.hpp"
#include "loxo/log/table.hpp"
#include "loxo/num/error.hpp"
#include "loxo/text/aside.hpp"
#include "loxo/text/csv.hpp"

namespace loxo {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSections[] = {"imu",      "odometer", "attitude", "track",    "fix",
                                     "velocity", "heading",  "height",   "reference"};

// What a CSV file needs quoted.
std::string cell(std::string_view s) {
  if (s.find_first_of(",\"\n\r") == std::string_view::npos) return std::string(s);
  std::string out = "\"";
  for (const char c : s) {
    if (c == '"') out += '"';
    out += c;
  }
  return out + '"';
}

// The form that rows go to.
class Sink {
 public:
  virtual ~Sink() = default;
  virtual void row(std::span<const double> numbers, std::span<const std::string_view> words) = 0;
};

class CsvSink : public Sink {
 public:
  // `order`: for each column of the header its place among the numbers, or ~place among the words.
  CsvSink(const std::string& path, const Table& table, std::vector<int> order)
      : out_(path), order_(std::move(order)) {
    for (const auto& [key, value] : table.described()) text_ += "# " + key + ": " + value + "\n";
    for (std::size_t i = 0; i < table.header().size(); ++i)
      text_ += (i > 0 ? "," : "") + cell(table.header()[i]);
    text_ += '\n';
  }
  void row(std::span<const double> numbers, std::span<const std::string_view> words) override {
    bool first = true;
    for (const int k : order_) {
      if (!first) text_ += ',';
      first = false;
      if (k >= 0)
        append_number(text_, numbers[static_cast<std::size_t>(k)]);
      else
        text_ += cell(words[static_cast<std::size_t>(~k)]);
    }
    text_ += '\n';
    if (text_.size() > (1u << 16)) flush();
  }
  void commit() {
    flush();
    out_.commit();
  }

 private:
  void flush() {
    out_.write(text_);
    text_.clear();
  }
  OutputFile out_;
  std::vector<int> order_;
  std::string text_;
};

class H5Sink : public Sink {
 public:
  explicit H5Sink(H5Writer& h5) : h5_(&h5) {}
  void row(std::span<const double> numbers, std::span<const std::string_view> words) override {
    h5_->row(numbers, words);
  }

 private:
  H5Writer* h5_;
};

// A table opened for all its columns.
struct Source {
  std::unique_ptr<Table> table;
  std::vector<std::string> numbers, words;
  std::vector<int> order;

  Source(const std::string& path, const std::string& name) : table(open_table(path, name)) {
    words = table->word_columns();
    std::set<std::string> seen;
    for (const auto& column : table->header()) {
      if (!seen.insert(column).second)
        throw Error(ErrorKind::kInput, "two columns are named '" + column + "'", path);
      const auto at = std::find(words.begin(), words.end(), column);
      if (at != words.end()) {
        order.push_back(~static_cast<int>(at - words.begin()));
      } else {
        order.push_back(static_cast<int>(numbers.size()));
        numbers.push_back(column);
      }
    }
    table->select(numbers);
  }
  std::size_t copy(Sink& to, bool keep_places, Diagnostics& d, const ConvertProgress& progress) {
    constexpr std::size_t kTold = 1u << 16;
    std::vector<double> row(numbers.size());
    const std::vector<double> hole(numbers.size(), kNone);
    const std::vector<std::string_view> no_words(words.size());
    std::vector<std::string_view> word(words.size());
    std::size_t written = 0;
    while (table->next(row, d)) {
      for (; keep_places && written + 1 < table->rows(); ++written) to.row(hole, no_words);
      for (std::size_t i = 0; i < words.size(); ++i) word[i] = table->word(words[i]);
      to.row(row, word);
      if (++written % kTold == 0 && progress) progress(written);
    }
    for (; keep_places && written < table->rows(); ++written) to.row(hole, no_words);
    return written;
  }
};

void describe(H5Writer& h5, const Table& table) {
  for (const auto& [key, value] : table.described()) h5.attribute(key, value);
}

// "imu.csv", "imu.csv.gz": names that a folder of CSV files can keep.
bool plain(const std::string& name) {
  return name.find('/') == std::string::npos && name.find(':') == std::string::npos &&
         (name.ends_with(".csv") || name.ends_with(".csv.gz"));
}

std::string escaped(const std::string& text) {
  static const std::regex special(R"([.^$|()\[\]{}*+?\\])");
  return std::regex_replace(text, special, R"(\$&)");
}

struct SectionTable {
  const ChannelFile* file;
  std::string section, name;  // the name it will have
};

}  // namespace

Converted convert_table(const std::string& from, const std::string& table, const std::string& to,
                        Diagnostics& d, const ConvertProgress& progress) {
  Source source(from, table);
  Converted done{1, 0};
  if (to.ends_with(".h5")) {
    H5Writer h5(to);
    h5.begin("", source.table->header(), source.words);
    describe(h5, *source.table);
    H5Sink sink(h5);
    done.rows = source.copy(sink, false, d, progress);
    h5.commit();
  } else {
    CsvSink sink(to, *source.table, source.order);
    done.rows = source.copy(sink, false, d, progress);
    sink.commit();
  }
  return done;
}

Converted convert_drive(const Drive& drive, const std::string& to, Diagnostics& d,
                        const ConvertProgress& progress) {
  const bool binary = to.ends_with(".h5");
  std::vector<SectionTable> tables;
  std::vector<std::pair<std::string, std::string>> same;  // section, the one whose table it shares
  std::set<std::string> names;
  for (const char* section : kSections) {
    const ChannelFile& file = section_file(drive, section);
    if (!file.present) continue;
    const auto shared = std::find_if(tables.begin(), tables.end(), [&](const SectionTable& t) {
      return t.file->named == file.named && t.file->named_table == file.named_table;
    });
    if (shared != tables.end()) {
      same.emplace_back(section, shared->section);
      continue;
    }
    std::string name = plain(file.named) ? file.named : std::string(section) + ".csv";
    if (!names.insert(name).second) names.insert(name = std::string(section) + ".csv");
    tables.push_back({&file, section, name});
  }

  Converted done;
  const auto told = [&](std::size_t rows) {
    if (progress) progress(done.rows + rows);
  };
  if (binary) {
    H5Writer h5(to);
    h5.text("drive.toml", drive.toml);
    for (const SectionTable& t : tables) {
      Source source(t.file->file, t.file->table);
      h5.begin(t.section, source.table->header(), source.words);
      h5.attribute("file", t.file->named);
      describe(h5, *source.table);
      H5Sink sink(h5);
      done.rows += source.copy(sink, true, d, told);
      ++done.tables;
    }
    for (const auto& [section, other] : same) h5.link(other, section);
    h5.commit();
    return done;
  }

  AsideFolder folder(to);
  std::string toml = drive.toml;
  for (const SectionTable& t : tables) {
    Source source(t.file->file, t.file->table);
    CsvSink sink(folder.file(t.name), *source.table, source.order);
    done.rows += source.copy(sink, true, d, told);
    sink.commit();
    ++done.tables;
    // Only the value of a key `file` is touched, and the `table` that a CSV file cannot have.
    if (t.name != t.file->named) {
      const std::regex file("(\\bfile[ \\t]*=[ \\t]*)(\"" + escaped(t.file->named) + "\"|'" +
                            escaped(t.file->named) + "')");
      toml = std::regex_replace(toml, file, "$1\"" + t.name + "\"");
    }
  }
  static const std::regex table_line(
      "(^|\\n)[ \\t]*table[ \\t]*=[ \\t]*(\"[^\"\\n]*\"|'[^'\\n]*')"
      "[ \\t\\r]*(#[^\\n]*)?(?=\\n|$)");
  toml = std::regex_replace(toml, table_line, "$1");
  OutputFile text(folder.file("drive.toml"));
  text.write(toml);
  text.commit();
  // What was written must read.
  read_drive(folder.file("drive.toml"));
  folder.commit();
  return done;
}

}  // namespace loxo
