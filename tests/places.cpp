// SPDX-License-Identifier: Apache-2.0
#include "places.hpp"

namespace loxo::testing {

const char* source_folder() { return LOXO_PLACE_SOURCE; }
const char* program() { return LOXO_PLACE_PROGRAM; }
const char* embed_program() { return LOXO_PLACE_EMBED; }

}  // namespace loxo::testing
