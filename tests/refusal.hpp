// SPDX-License-Identifier: Apache-2.0
// Test support: what bad input is refused with.
#pragma once
#include <gtest/gtest.h>

#include <string>

#include "loxo/num/error.hpp"

namespace loxo::testing {

// The message of the Error that `act` throws, for input that cannot be used (exit code 3); fails,
// with `what` was tried, where nothing is thrown.
template <class F>
std::string refusal(const F& act, const std::string& what = "it") {
  try {
    act();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), 3) << e.what();
    return e.what();
  }
  ADD_FAILURE() << what << " was taken";
  return {};
}

}  // namespace loxo::testing
