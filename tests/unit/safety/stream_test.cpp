// SPDX-License-Identifier: Apache-2.0
/** @file Command monitor, state stamps, watchdog and lease: permitted sources and ages of commands. */
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "safety/budgets.h"
#include "safety/command_monitor.h"
#include "safety/control_lease.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::safety {
namespace {

using test::baseSeed;
using test::Random;
using test::trace;

constexpr std::int64_t kMs = 1'000'000;

TEST(CommandMonitor, RequiresRisingSequencesWithinASession) {
  CommandMonitor monitor(2, 0.3, 0.05);
  EXPECT_EQ(monitor.check({7, 3, 0.1, 2}, true).faults, 0u);
  EXPECT_EQ(monitor.check({7, 3, 0.1, 2}, false).faults, bit(Fault::kOutOfSequence));
  EXPECT_EQ(monitor.check({7, 2, 0.1, 2}, true).faults, bit(Fault::kOutOfSequence));
  EXPECT_EQ(monitor.check({7, 9, 0.1, 2}, false).faults, 0u);
  EXPECT_EQ(monitor.sequence(), 9u);
  // The number of a command that is too old is not accepted again.
  EXPECT_EQ(monitor.check({7, 10, 0.4, 2}, false).faults, bit(Fault::kStaleCommand));
  EXPECT_EQ(monitor.check({7, 10, 0.1, 2}, false).faults, bit(Fault::kOutOfSequence));
  EXPECT_EQ(monitor.sequence(), 9u);
}

TEST(CommandMonitor, AcceptsAnotherSessionOnlyAtStandstill) {
  CommandMonitor monitor(1, 0.3, 0.05);
  EXPECT_TRUE(monitor.check({7, 5, 0.0, 1}, true).new_session);
  EXPECT_FALSE(monitor.check({7, 6, 0.0, 1}, false).new_session);
  EXPECT_EQ(monitor.check({8, 1, 0.0, 1}, false).faults, bit(Fault::kOutOfSequence));
  EXPECT_EQ(monitor.session(), 7u);
  const StreamCheck checked = monitor.check({8, 1, 0.0, 1}, true);
  EXPECT_EQ(checked.faults, 0u);
  EXPECT_TRUE(checked.new_session);
  EXPECT_EQ(monitor.check({0, 1, 0.0, 1}, true).faults, bit(Fault::kOutOfSequence));
}

TEST(CommandMonitor, RefusesAgesAndArmsThatAreWrong) {
  CommandMonitor monitor(2, 0.3, 0.05);
  EXPECT_EQ(monitor.check({1, 1, 0.3, 2}, true).faults, 0u);
  const StreamCheck late = monitor.check({1, 2, 0.35, 2}, true);
  EXPECT_EQ(late.faults, bit(Fault::kStaleCommand));
  EXPECT_NEAR(late.age_excess, 0.05, 1e-12);
  EXPECT_EQ(monitor.check({1, 3, std::numeric_limits<double>::infinity(), 2}, true).faults, bit(Fault::kStaleCommand));
  EXPECT_EQ(monitor.check({1, 4, std::nan(""), 2}, true).faults, bit(Fault::kStaleCommand));
  EXPECT_EQ(monitor.check({1, 5, 0.0, 1}, true).faults, bit(Fault::kUnknownArm));
  EXPECT_EQ(monitor.check({2, 6, 0.4, 2}, true).faults, bit(Fault::kStaleCommand));
  EXPECT_EQ(monitor.session(), 1u) << "a command that is too old does not take over";
}

TEST(SuccessRate, CountsTheLossesOfTheLastHundredAsCountingOneByOneDoes) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 20; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const double loss = random.chance(0.5) ? 0.1 : 0.6;
    SuccessRate rate;
    const std::uint64_t due_before = 1000, came_before = 77;
    std::uint64_t due = due_before, came = came_before;
    rate.note(due, came);
    EXPECT_EQ(rate.value(), 1.0);
    std::deque<bool> arrived;
    for (int i = 0; i < 600; ++i) {
      const bool arrives = !random.chance(loss);
      arrived.push_back(arrives);
      if (arrived.size() > SuccessRate::kWindow)
        arrived.pop_front();
      ++due;
      came += arrives ? 1 : 0;
      // A receiver detects only arrivals; losses appear with the next sample, or with the next SYNC.
      if (arrives || random.chance(0.5)) {
        rate.note(due, came);
        ASSERT_EQ(rate.lost(), static_cast<std::uint64_t>(std::count(arrived.begin(), arrived.end(), false))) << i;
      }
    }
  }
}

TEST(SuccessRate, LateSamplesAreNoLossesAndALongGapLosesAtMostAll) {
  SuccessRate rate;
  rate.note(1, 0);  // the answer to the first one is on its way, and so on
  for (std::uint64_t due = 2; due < 400; ++due) {
    rate.note(due, due - 1);
    ASSERT_EQ(rate.lost(), 0u);
  }
  rate.note(405, 399);  // five come late
  EXPECT_EQ(rate.lost(), 5u);
  rate.note(405, 404);
  EXPECT_EQ(rate.lost(), 0u);
  rate.note(1'000'000, 404);
  EXPECT_EQ(rate.value(), 0.0);
  for (std::uint64_t i = 1; i <= SuccessRate::kWindow; ++i)
    rate.note(1'000'000 + i, 404 + i);
  EXPECT_EQ(rate.value(), 1.0);
  rate.note(3, 2);  // restarts from the beginning
  EXPECT_EQ(rate.value(), 1.0);
}

TEST(StreamSuccess, BearsAnyNumbers) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 50; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    constexpr auto kMost = std::numeric_limits<std::uint64_t>::max();
    const std::uint64_t numbers[] = {0, 1, 2, 99, 100, 101, kMost / 2, kMost / 2 + 1, kMost - 1, kMost};
    const auto any = [&] { return numbers[static_cast<std::size_t>(random.integer(0, 9))]; };
    StreamSuccess success;
    for (std::uint64_t arrivals = 1; arrivals <= 200; ++arrivals) {
      success.note(random.chance(0.9) ? 1 : any(), any(), static_cast<std::int64_t>(any()), arrivals);
      if (random.chance(0.1))
        success.resetLosses();
      ASSERT_TRUE(success.value() >= 0.0 && success.value() <= 1.0);
      const FaultRecord lost = success.judge(Fault::kCommandTimeout, 0.05, 0.03);
      if (lost.faults != 0) {
        ASSERT_TRUE(lost.amount > lost.allowed && lost.amount <= 1.0) << lost.amount;
        ASSERT_TRUE(lost.allowed >= 0.05) << lost.allowed;
      }
    }
  }
}

TEST(CommandMonitor, NamesTheShareOfCommandsThatAreLost) {
  for (const double period : {0.001, 0.01, 0.1}) {
    SCOPED_TRACE(period);
    const double age = std::max(0.03, 3 * period), allowed = std::max(0.05, age / (100 * period));
    CommandMonitor monitor(1, age, 0.05);
    std::uint64_t arrivals = 0;
    const auto check = [&](std::uint64_t sequence) {
      StreamHeader header{7, sequence, 0.0, 1};
      header.stamp = static_cast<std::int64_t>(1e9 * period * static_cast<double>(sequence));
      header.arrivals = ++arrivals;
      const StreamCheck checked = monitor.check(header, sequence == 1);
      EXPECT_EQ(checked.faults, 0u) << "what came is obeyed";
      return checked.lost;
    };
    std::uint64_t sequence = 1;
    EXPECT_EQ(check(sequence).faults, 0u);
    const auto tolerated = static_cast<std::uint64_t>(100 * allowed + 1e-9);
    for (std::uint64_t lost = 0; lost <= 2 * tolerated; ++lost) {  // every other one
      const FaultRecord record = check(sequence += 2);
      EXPECT_EQ(record.faults != 0, lost + 1 > tolerated) << lost;
      if (record.faults == 0)
        continue;
      EXPECT_EQ(record.faults, bit(Fault::kCommandTimeout));
      EXPECT_EQ(record.cause, FaultCause::kLost);
      EXPECT_NEAR(record.amount, std::min(0.5, 0.01 * static_cast<double>(lost + 1)), 1e-9);
      EXPECT_NEAR(record.allowed, allowed, 1e-6);
    }
    for (int i = 0; i < 100; ++i)
      check(++sequence);
    EXPECT_EQ(check(++sequence).faults, 0u) << "the last hundred came";
    EXPECT_EQ(monitor.success(), 1.0);
  }
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

TEST(ReportedFaults, NewFaultIsSeenInAnswersToTheStateThatReportsIt) {
  const FaultMask drive = bit(Fault::kDrive), stop = bit(Fault::kStopRequested);
  ReportedFaults reported;
  EXPECT_TRUE(reported.seen(0, 0, 0)) << "there is none";
  EXPECT_FALSE(reported.seen(0, drive, 100)) << "no state has shown it yet";
  reported.record(0, drive, 10);
  reported.record(0, drive, 11);
  EXPECT_FALSE(reported.seen(0, drive, 9));
  EXPECT_TRUE(reported.seen(0, drive, 10));
  EXPECT_FALSE(reported.seen(0, drive | stop, 11)) << "another one came";
  reported.record(0, drive | stop, 12);
  EXPECT_FALSE(reported.seen(0, drive | stop, 11));
  EXPECT_TRUE(reported.seen(0, drive | stop, 12));
  reported.forget(0);
  EXPECT_FALSE(reported.seen(0, drive | stop, 13)) << "it came once more";
  reported.record(0, drive | stop, 14);
  EXPECT_TRUE(reported.seen(0, drive | stop, 14));
  EXPECT_FALSE(reported.seen(1, drive, 14)) << "another arm";
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
  EXPECT_EQ(lease.owner(0), 0u);
  EXPECT_FALSE(lease.acquire(0, 0));
  EXPECT_TRUE(lease.acquire(5, 10 * kMs));
  EXPECT_FALSE(lease.acquire(6, 20 * kMs));
  EXPECT_EQ(lease.owner(20 * kMs), 5u);
  EXPECT_FALSE(lease.keep(6, 20 * kMs));
  EXPECT_TRUE(lease.keep(5, 900 * kMs));
  EXPECT_TRUE(lease.isOwner(5, 1900 * kMs));
  EXPECT_FALSE(lease.release(6, 1900 * kMs));
  EXPECT_FALSE(lease.takeLoss(1900 * kMs));
  EXPECT_FALSE(lease.keep(5, 1901 * kMs)) << "a lease that was lost is not kept, it is acquired anew";
  EXPECT_TRUE(lease.takeLoss(1901 * kMs));
  EXPECT_FALSE(lease.takeLoss(1901 * kMs));
  EXPECT_TRUE(lease.acquire(6, 1901 * kMs));
  EXPECT_TRUE(lease.release(6, 1902 * kMs));
  EXPECT_EQ(lease.owner(1902 * kMs), 0u);
  EXPECT_FALSE(lease.takeLoss(9000 * kMs)) << "a lease that was given back is not lost";
}

}  // namespace
}  // namespace tandem::safety
