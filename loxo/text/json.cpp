// SPDX-License-Identifier: Apache-2.0
#include "loxo/text/json.hpp"

#include "loxo/num/error.hpp"
#include "loxo/text/gzip.hpp"

namespace loxo {

Json parse_json(const std::string& text, const std::string& where) {
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& e) {
    std::size_t line = 1, column = 1;
    const std::size_t at = e.byte > 0 ? e.byte - 1 : 0;
    for (std::size_t i = 0; i < at && i < text.size(); ++i) {
      ++column;
      if (text[i] == '\n') {
        ++line;
        column = 1;
      }
    }
    // "[json.exception.parse_error.101] parse error at line 1, column 2: reason"
    std::string reason = e.what();
    if (const auto colon = reason.find(": "); colon != std::string::npos)
      reason = reason.substr(colon + 2);
    throw Error(ErrorKind::kInput, "not valid JSON: " + reason,
                where + ":" + std::to_string(line) + ":" + std::to_string(column));
  }
}

Json read_json(const std::string& path) { return parse_json(read_file(path), path); }

std::string dump_json(const Json& json, int indent) {
  // Foreign text (file names, cells) may not be UTF-8: replaced, never a crash.
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace loxo
