// SPDX-License-Identifier: Apache-2.0
/** @file Command monitor, state stamps, watchdog and lease: who may command, and for how long silence lasts. */
#include <gtest/gtest.h>

#include <cmath>

#include "safety/budgets.h"
#include "safety/command_monitor.h"
#include "safety/control_lease.h"

namespace tandem::safety {
namespace {

constexpr std::int64_t kMs = 1'000'000;

TEST(CommandMonitor, WantsRisingNumbersWithinASession) {
  CommandMonitor monitor(2, 0.3);
  EXPECT_EQ(monitor.check({7, 3, 0.1, 2}, true).faults, 0u);
  EXPECT_EQ(monitor.check({7, 3, 0.1, 2}, false).faults, bit(Fault::kOutOfSequence));
  EXPECT_EQ(monitor.check({7, 2, 0.1, 2}, true).faults, bit(Fault::kOutOfSequence));
  EXPECT_EQ(monitor.check({7, 9, 0.1, 2}, false).faults, 0u);
  EXPECT_EQ(monitor.sequence(), 9u);
  // A number that was used up by a command that is too old does not come again.
  EXPECT_EQ(monitor.check({7, 10, 0.4, 2}, false).faults, bit(Fault::kStaleCommand));
  EXPECT_EQ(monitor.check({7, 10, 0.1, 2}, false).faults, bit(Fault::kOutOfSequence));
  EXPECT_EQ(monitor.sequence(), 9u);
}

TEST(CommandMonitor, LetsAnotherSessionInOnlyWhileTheRobotStands) {
  CommandMonitor monitor(1, 0.3);
  EXPECT_TRUE(monitor.check({7, 5, 0.0, 1}, true).new_session);
  EXPECT_FALSE(monitor.check({7, 6, 0.0, 1}, false).new_session);
  EXPECT_EQ(monitor.check({8, 1, 0.0, 1}, false).faults, bit(Fault::kOutOfSequence));
  EXPECT_EQ(monitor.session(), 7u);
  const StreamVerdict verdict = monitor.check({8, 1, 0.0, 1}, true);
  EXPECT_EQ(verdict.faults, 0u);
  EXPECT_TRUE(verdict.new_session);
  EXPECT_EQ(monitor.check({0, 1, 0.0, 1}, true).faults, bit(Fault::kOutOfSequence));
}

TEST(CommandMonitor, RefusesAgesAndArmsThatAreWrong) {
  CommandMonitor monitor(2, 0.3);
  EXPECT_EQ(monitor.check({1, 1, 0.3, 2}, true).faults, 0u);
  const StreamVerdict late = monitor.check({1, 2, 0.35, 2}, true);
  EXPECT_EQ(late.faults, bit(Fault::kStaleCommand));
  EXPECT_NEAR(late.age_excess, 0.05, 1e-12);
  EXPECT_EQ(monitor.check({1, 3, std::numeric_limits<double>::infinity(), 2}, true).faults, bit(Fault::kStaleCommand));
  EXPECT_EQ(monitor.check({1, 4, std::nan(""), 2}, true).faults, bit(Fault::kStaleCommand));
  EXPECT_EQ(monitor.check({1, 5, 0.0, 1}, true).faults, bit(Fault::kUnknownArm));
  EXPECT_EQ(monitor.check({2, 6, 0.4, 2}, true).faults, bit(Fault::kStaleCommand));
  EXPECT_EQ(monitor.session(), 1u) << "a command that is too old does not take over";
}

TEST(StateStamps, KnowTheAgeOfStatesThatAreNotForgotten) {
  StateStamps stamps;
  EXPECT_TRUE(std::isinf(stamps.age(1, 0)));
  for (std::uint64_t s = 1; s <= 5000; ++s)
    stamps.record(s, static_cast<std::int64_t>(s) * kMs);
  EXPECT_NEAR(stamps.age(5000, 5030 * kMs), 0.030, 1e-12);
  EXPECT_NEAR(stamps.age(4000, 5000 * kMs), 1.0, 1e-12);
  EXPECT_TRUE(std::isinf(stamps.age(1, 5000 * kMs)));
  EXPECT_TRUE(std::isinf(stamps.age(5001, 5000 * kMs)));
  EXPECT_TRUE(std::isinf(stamps.age(0, 5000 * kMs)));
}

TEST(Watchdog, ExpiresAfterItsBudgetAndNotBefore) {
  Watchdog watchdog(0.3);
  watchdog.feed(1000 * kMs);
  EXPECT_FALSE(watchdog.expired(1300 * kMs));
  EXPECT_TRUE(watchdog.expired(1300 * kMs + 1));
  EXPECT_NEAR(watchdog.silence(1100 * kMs), 0.1, 1e-12);
}

TEST(Budgets, AgeIsTheLargerOfFloorAndPeriods) {
  const Budgets budgets;
  EXPECT_DOUBLE_EQ(budgets.commandAge(0.1), 0.3);
  EXPECT_DOUBLE_EQ(budgets.commandAge(0.001), 0.030);
}

TEST(ControlLease, BelongsToOneClientUntilReleasedOrSilent) {
  ControlLease lease(1.0);
  EXPECT_EQ(lease.holder(0), 0u);
  EXPECT_FALSE(lease.acquire(0, 0));
  EXPECT_TRUE(lease.acquire(5, 10 * kMs));
  EXPECT_FALSE(lease.acquire(6, 20 * kMs));
  EXPECT_EQ(lease.holder(20 * kMs), 5u);
  EXPECT_FALSE(lease.keep(6, 20 * kMs));
  EXPECT_TRUE(lease.keep(5, 900 * kMs));
  EXPECT_TRUE(lease.holds(5, 1900 * kMs));
  EXPECT_FALSE(lease.release(6, 1900 * kMs));
  EXPECT_FALSE(lease.takeLoss(1900 * kMs));
  EXPECT_FALSE(lease.keep(5, 1901 * kMs)) << "a lease that was lost is not kept, it is acquired anew";
  EXPECT_TRUE(lease.takeLoss(1901 * kMs));
  EXPECT_FALSE(lease.takeLoss(1901 * kMs));
  EXPECT_TRUE(lease.acquire(6, 1901 * kMs));
  EXPECT_TRUE(lease.release(6, 1902 * kMs));
  EXPECT_EQ(lease.holder(1902 * kMs), 0u);
  EXPECT_FALSE(lease.takeLoss(9000 * kMs)) << "a lease that was given back is not lost";
}

}  // namespace
}  // namespace tandem::safety
