// SPDX-License-Identifier: Apache-2.0
#include "safety/idle_power.h"

#include <gtest/gtest.h>

#include <limits>

namespace tandem::safety {
namespace {

using Decision = IdlePower::Decision;
constexpr std::int64_t kSecond = 1'000'000'000;

TEST(IdlePower, TakesPowerOnceFromAnArmThatHoldsWithout) {
  IdlePower idle(60.0);
  for (std::int64_t s = 0; s < 60; ++s)
    EXPECT_EQ(idle.step(0, true, false, true, s * kSecond), Decision::kNothing) << s;
  EXPECT_DOUBLE_EQ(idle.idle(0), 59.0);
  EXPECT_NEAR(idle.left(0), 1.0, 1e-9);
  EXPECT_EQ(idle.step(0, true, false, true, 60 * kSecond), Decision::kPowerOff);
  EXPECT_EQ(idle.step(0, false, false, true, 61 * kSecond), Decision::kNothing);
  EXPECT_EQ(idle.idle(0), 0.0);
  EXPECT_EQ(idle.left(0), -1.0);
}

TEST(IdlePower, WarnsAgainAndAgainWhereAnArmDoesNotHold) {
  IdlePower idle(60.0);
  int warnings = 0;
  for (std::int64_t s = 0; s <= 600; ++s) {
    const Decision decision = idle.step(3, true, false, false, s * kSecond);
    EXPECT_NE(decision, Decision::kPowerOff);
    EXPECT_EQ(idle.left(3), -1.0);
    warnings += decision == Decision::kWarn ? 1 : 0;
  }
  EXPECT_EQ(warnings, 10);
}

TEST(IdlePower, EveryCommanderBeginsTheTimeAnew) {
  IdlePower idle(60.0);
  for (std::int64_t s = 0; s <= 1000; ++s)
    EXPECT_EQ(idle.step(0, true, s % 50 == 0, true, s * kSecond), Decision::kNothing) << s;
}

TEST(IdlePower, InfiniteTimeoutKeepsPower) {
  IdlePower idle(std::numeric_limits<double>::infinity());
  for (std::int64_t s = 0; s <= 100'000; s += 100)
    EXPECT_EQ(idle.step(0, true, false, true, s * kSecond), Decision::kNothing);
  EXPECT_EQ(idle.left(0), -1.0);
}

}  // namespace
}  // namespace tandem::safety
