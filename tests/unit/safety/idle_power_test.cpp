// SPDX-License-Identifier: Apache-2.0
#include "safety/idle_power.h"

#include <gtest/gtest.h>

#include <limits>

namespace tandem::safety {
namespace {

using Verdict = IdlePower::Verdict;
constexpr std::int64_t kSecond = 1'000'000'000;

TEST(IdlePower, TakesPowerOnceFromAnArmThatHoldsWithout) {
  IdlePower idle(60.0);
  for (std::int64_t s = 0; s < 60; ++s)
    EXPECT_EQ(idle.step(0, true, false, true, s * kSecond), Verdict::kNothing) << s;
  EXPECT_DOUBLE_EQ(idle.idle(0), 59.0);
  EXPECT_NEAR(idle.left(0), 1.0, 1e-9);
  EXPECT_EQ(idle.step(0, true, false, true, 60 * kSecond), Verdict::kPowerOff);
  EXPECT_EQ(idle.step(0, false, false, true, 61 * kSecond), Verdict::kNothing);
  EXPECT_EQ(idle.idle(0), 0.0);
  EXPECT_EQ(idle.left(0), -1.0);
}

TEST(IdlePower, WarnsAgainAndAgainWhereAnArmDoesNotHold) {
  IdlePower idle(60.0);
  int warnings = 0;
  for (std::int64_t s = 0; s <= 600; ++s) {
    const Verdict verdict = idle.step(3, true, false, false, s * kSecond);
    EXPECT_NE(verdict, Verdict::kPowerOff);
    EXPECT_EQ(idle.left(3), -1.0);
    warnings += verdict == Verdict::kWarn ? 1 : 0;
  }
  EXPECT_EQ(warnings, 10);
}

TEST(IdlePower, EveryCommanderBeginsTheTimeAnew) {
  IdlePower idle(60.0);
  for (std::int64_t s = 0; s <= 1000; ++s)
    EXPECT_EQ(idle.step(0, true, s % 50 == 0, true, s * kSecond), Verdict::kNothing) << s;
}

TEST(IdlePower, NeverWithoutPatience) {
  IdlePower idle(std::numeric_limits<double>::infinity());
  for (std::int64_t s = 0; s <= 100'000; s += 100)
    EXPECT_EQ(idle.step(0, true, false, true, s * kSecond), Verdict::kNothing);
  EXPECT_EQ(idle.left(0), -1.0);
}

}  // namespace
}  // namespace tandem::safety
