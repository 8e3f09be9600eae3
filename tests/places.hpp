// SPDX-License-Identifier: Apache-2.0
// Where the checkout and its programs stand. Said in one small file (places.cpp), not in every
// test's compile command, so that a compiler cache serves all checkouts.
#pragma once

namespace loxo::testing {

const char* source_folder();  // the checkout
const char* program();        // build/loxo; empty in the tests of a room
const char* embed_program();  // the example of embedding; empty in the tests of a room

}  // namespace loxo::testing
