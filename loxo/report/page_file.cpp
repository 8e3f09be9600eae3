// SPDX-License-Identifier: Apache-2.0
#include "loxo/report/page_html.hpp"
#include "loxo/text/csv.hpp"

namespace loxo::report {

void write_page(const Page& page, const std::string& path) {
  const std::string html = to_html(page);
  OutputFile file(path);
  file.write(html);
  file.commit();
}

}  // namespace loxo::report
