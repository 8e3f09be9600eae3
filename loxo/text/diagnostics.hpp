// SPDX-License-Identifier: Apache-2.0
// "The data is dirty": what a reader or a method noticed and did not repair in silence. Counted by
// kind; the first few of each kind are kept with their place, for the terminal, --json and the
// report.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace loxo {

enum class Severity { kNote, kWarning, kBad };

struct Diagnostic {
  Severity severity = Severity::kWarning;
  std::string kind;   // a short stable word: "gap", "bad_row", "time_back", "unknown_column" …
  std::string where;  // file:line or key, may be empty
  std::string what;   // one sentence: expected, found
  std::size_t count = 1;
};

class Diagnostics {
 public:
  // Keeps the first kKept of a kind as they are; further ones only count up on the last kept.
  static constexpr std::size_t kKept = 5;
  void add(Severity severity, std::string_view kind, std::string where, std::string what);
  void note(std::string_view kind, std::string where, std::string what) {
    add(Severity::kNote, kind, std::move(where), std::move(what));
  }
  void warn(std::string_view kind, std::string where, std::string what) {
    add(Severity::kWarning, kind, std::move(where), std::move(what));
  }
  void bad(std::string_view kind, std::string where, std::string what) {
    add(Severity::kBad, kind, std::move(where), std::move(what));
  }
  const std::vector<Diagnostic>& list() const { return list_; }
  bool empty() const { return list_.empty(); }
  std::size_t count(std::string_view kind) const;
  void append(const Diagnostics& other);

 private:
  std::vector<Diagnostic> list_;
};

}  // namespace loxo
