// SPDX-License-Identifier: Apache-2.0
// The front end, bundled from web/ when the program is built (cmake/ReportWeb.cmake).
#pragma once
#include <cstddef>

namespace loxo::report {

extern const char* const kWebStyle;
extern const std::size_t kWebStyleSize;
extern const char* const kWebScript;
extern const std::size_t kWebScriptSize;
extern const char* const kWebCoast;  // see coast.cpp
extern const std::size_t kWebCoastSize;

}  // namespace loxo::report
