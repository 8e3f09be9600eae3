// SPDX-License-Identifier: Apache-2.0
#include "loxo/report/page_html.hpp"

#include "loxo/num/error.hpp"
#include "loxo/report/web_bundle.hpp"

namespace loxo::report {
namespace {

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '&')
      out += "&amp;";
    else
      out += c;
  }
  return out;
}

}  // namespace

std::string to_html(const Page& page) {
  std::string head =
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      // The browser itself refuses any request that a mistake could make.
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'; "
      "script-src 'unsafe-inline'; img-src data: blob:\">\n"
      "<title>" +
      escaped(page.title) + "</title>\n<style>";
  head.append(kWebStyle, kWebStyleSize);
  head +=
      "</style>\n</head>\n<body>\n<noscript>This page draws its figures with a script of its own; "
      "please allow scripts.</noscript>\n"
      "<script type=\"application/json\" id=\"page\">";
  std::string tail = "</script>\n<script>";
  tail.append(kWebScript, kWebScriptSize);
  tail += "</script>\n</body>\n</html>\n";
  std::size_t size = 0;
  for (const std::size_t points : {2000, 1400, 800, 400, 200, 100, 50, 24, 12}) {
    std::string json = to_json(page, points);
    size = head.size() + json.size() + tail.size();
    if (size < kMaxBytes) return head + json + tail;
  }
  throw Error(ErrorKind::kWork, "the report would have " + std::to_string(size) +
                                    " bytes, more than " + std::to_string(kMaxBytes) +
                                    ", even with 12 points a curve; give fewer inputs");
}

}  // namespace loxo::report
