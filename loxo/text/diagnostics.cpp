// SPDX-License-Identifier: Apache-2.0
#include "loxo/text/diagnostics.hpp"

namespace loxo {

void Diagnostics::add(Severity severity, std::string_view kind, std::string where,
                      std::string what) {
  std::size_t kept = 0;
  Diagnostic* last = nullptr;
  for (auto& d : list_) {
    if (d.kind == kind) {
      // The same place says the same: a file that is read twice.
      if (d.where == where && d.what == what && where.find(':') != std::string::npos) return;
      ++kept;
      last = &d;
    }
  }
  if (kept >= kKept) {
    ++last->count;
    if (severity > last->severity) last->severity = severity;
    return;
  }
  Diagnostic d;
  d.severity = severity;
  d.kind = kind;
  d.where = std::move(where);
  d.what = std::move(what);
  list_.push_back(std::move(d));
}

std::size_t Diagnostics::count(std::string_view kind) const {
  std::size_t n = 0;
  for (const auto& d : list_) {
    if (d.kind == kind) n += d.count;
  }
  return n;
}

void Diagnostics::append(const Diagnostics& other) {
  for (const auto& d : other.list_) {
    const std::size_t before = count(d.kind);
    add(d.severity, d.kind, d.where, d.what);
    if (d.count == 1) continue;
    // The rest of a counted one: on the last kept of its kind.
    for (auto it = list_.rbegin(); it != list_.rend(); ++it) {
      if (it->kind == d.kind) {
        it->count += before + d.count - count(d.kind);
        break;
      }
    }
  }
}

}  // namespace loxo
