// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/periodic_loop.h"

#include <gtest/gtest.h>

#include <random>

namespace tandem::runtime {
namespace {

void spinUntil(std::int64_t when) {
  while (monotonicNow() < when) {
  }
}

TEST(PeriodicLoop, RefusesPeriodsThatMakeNoSense) {
  EXPECT_THROW(PeriodicLoop(0.0), std::invalid_argument);
  EXPECT_THROW(PeriodicLoop(-1.0), std::invalid_argument);
  EXPECT_THROW(PeriodicLoop(61.0), std::invalid_argument);
  constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(PeriodicLoop{kNotANumber}, std::invalid_argument);
}

TEST(PeriodicLoop, KeepsItsGridAndNeverStartsEarly) {
  constexpr std::int64_t kPeriod = 2'000'000;
  PeriodicLoop loop(2e-3);
  std::int64_t first = 0;
  std::uint64_t early = 0, off_grid = 0;
  loop.run([&](const Tick& tick) {
    first = first == 0 ? tick.scheduled : first;
    early += tick.now < tick.scheduled ? 1 : 0;
    off_grid += (tick.scheduled - first) % kPeriod == 0 ? 0 : 1;
    return tick.cycle < 100;
  });
  EXPECT_EQ(early, 0u);
  EXPECT_EQ(off_grid, 0u);
  EXPECT_EQ(loop.statistics().cycles, 100u);
  EXPECT_GE(loop.statistics().lateness_max, loop.statistics().lateness_mean);
  EXPECT_GE(loop.statistics().execution_max, loop.statistics().execution_mean);
}

TEST(PeriodicLoop, CountsProvokedOverruns) {
  constexpr std::int64_t kPeriod = 4'000'000;
  PeriodicLoop loop(4e-3);
  std::uint64_t skipped_after = 0, skipped_in_ticks = 0, overruns_seen = 0;
  std::int64_t first = 0, last = 0;
  loop.run([&](const Tick& tick) {
    first = first == 0 ? tick.scheduled : first;
    last = tick.scheduled;
    skipped_in_ticks += tick.skipped;
    if (tick.cycle == 5) {
      spinUntil(tick.now + 7 * kPeriod / 2);  // 3.5 periods: two of them are completely in the past
    }
    if (tick.cycle == 6) {
      skipped_after = tick.skipped;
      overruns_seen = loop.statistics().overruns;
    }
    return tick.cycle < 20;
  });
  const LoopStatistics& statistics = loop.statistics();
  EXPECT_GE(skipped_after, 2u);
  EXPECT_GE(overruns_seen, 1u);
  EXPECT_EQ(statistics.skipped, skipped_in_ticks);
  EXPECT_GE(statistics.execution_max, 3.5 * 4e-3 - 1e-3);
  // All periods are counted, for any timing of the machine.
  EXPECT_EQ(statistics.cycles + statistics.skipped, static_cast<std::uint64_t>((last - first) / kPeriod) + 1);
}

TEST(PeriodicLoop, BooksBalanceUnderRandomLoad) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_int_distribution<std::int64_t> load(0, 3'000'000);
  constexpr std::int64_t kPeriod = 1'000'000;
  PeriodicLoop loop(1e-3);
  std::int64_t first = 0, last = 0;
  std::uint64_t too_long = 0;
  loop.run([&](const Tick& tick) {
    first = first == 0 ? tick.scheduled : first;
    last = tick.scheduled;
    const std::int64_t until = tick.now + load(random);
    spinUntil(until);
    too_long += until > tick.scheduled + kPeriod ? 1 : 0;
    return tick.cycle < 100;
  });
  EXPECT_EQ(loop.statistics().cycles + loop.statistics().skipped,
            static_cast<std::uint64_t>((last - first) / kPeriod) + 1);
  EXPECT_GE(loop.statistics().overruns, too_long);
}

TEST(EnterRealtime, ReportsWhatIsRefused) {
  EXPECT_TRUE(enterRealtime(0, false).empty());
  const auto refused = enterRealtime(1000, false);  // no such priority exists, for any user
  ASSERT_EQ(refused.size(), 1u);
  EXPECT_NE(refused[0].find("1000"), std::string::npos);
}

}  // namespace
}  // namespace tandem::runtime
