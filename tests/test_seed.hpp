// SPDX-License-Identifier: Apache-2.0
// Test support: the one door through which chance comes into a test. What it prints repeats the
// run: LOXO_SEED=7 build/num_tests --gtest_filter=...
#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

namespace loxo::testing {

// The seed of the test that runs: $LOXO_SEED, else `otherwise()`. The same wherever the test asks;
// printed once, before the first draw, and kept in the test's report as a property.
template <typename Otherwise>
std::uint64_t seed_or(Otherwise otherwise) {
  constexpr const char* kName = "LOXO_SEED";
  const auto number = [](const char* text) { return std::strtoull(text, nullptr, 10); };
  // A test that begins again (--gtest_repeat) has no properties yet: a new seed then.
  const ::testing::TestInfo* test = ::testing::UnitTest::GetInstance()->current_test_info();
  for (int i = 0; test != nullptr && i < test->result()->test_property_count(); ++i) {
    const ::testing::TestProperty& said = test->result()->GetTestProperty(i);
    if (std::string(said.key()) == kName) return number(said.value());
  }
  const char* given = std::getenv(kName);
  const std::uint64_t seed = given != nullptr ? number(given) : otherwise();
  std::printf("%s=%llu\n", kName, static_cast<unsigned long long>(seed));
  std::fflush(stdout);
  if (test != nullptr) ::testing::Test::RecordProperty(kName, std::to_string(seed));
  return seed;
}

// Another one each time: for laws that hold for every seed.
inline std::uint64_t seed() {
  return seed_or([] { return std::uint64_t{std::random_device{}()}; });
}
// `fixed` unless $LOXO_SEED says another.
inline std::uint64_t seed(std::uint64_t fixed) {
  return seed_or([=] { return fixed; });
}

}  // namespace loxo::testing
