// SPDX-License-Identifier: Apache-2.0
// What `loxo campaign` lends to `loxo report`.
#pragma once
#include <string>

#include "loxo/report/page.hpp"

namespace loxo::cli {

// The page of `loxo campaign report STORE`. Throws Error(kInput) where the store holds no trial.
report::Page campaign_page(const std::string& store);

}  // namespace loxo::cli
