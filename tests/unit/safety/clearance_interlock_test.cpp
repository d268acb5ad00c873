// SPDX-License-Identifier: Apache-2.0
#include "safety/clearance_interlock.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/safety/random_arm.h"

namespace tandem::safety {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000;
constexpr double kLeast = 1e-3, kBudget = 0.5;

/** Judges a new distance every 10 ms. */
struct Arms {
  ClearanceInterlock interlock{kLeast, kBudget};
  std::int64_t now = 1'000 * kMillisecond;

  FaultRecord at(double distance, bool moving = true) {
    now += 10 * kMillisecond;
    return interlock.judge({distance, now}, moving, now);
  }
  bool stops(double distance) { return at(distance).faults == bit(Fault::kClearance); }
};

TEST(ClearanceInterlock, StopsAtTheLeastDistanceAndSaysBoth) {
  Arms arms;
  EXPECT_FALSE(arms.stops(1.2e-3));
  EXPECT_FALSE(arms.stops(1.0e-3));
  const FaultRecord record = arms.at(0.25e-3);
  EXPECT_EQ(describe(record), "clearance: 0.25 mm, expected at least 1 mm");
  EXPECT_EQ(arms.at(-0.3e-3, false).faults, 0u) << "arms without power";
}

TEST(ClearanceInterlock, LetsArmsBeMovedApartAndStopsEveryApproach) {
  const std::uint32_t seed = test::baseSeed();
  SCOPED_TRACE(test::trace(seed));
  test::Random random(seed);
  Arms arms;
  int stops = 0;
  for (int round = 0; round < 2000; ++round) {
    double distance = random.uniform(-2e-3, 0.9e-3);
    arms.at(2e-3);
    ASSERT_TRUE(arms.stops(distance)) << "the first time";
    double widest = distance;
    for (int i = 0; i < 20; ++i) {
      if (random.chance(0.5)) {
        distance = std::min(distance + random.uniform(0.0, 0.2e-3), 0.95e-3);
        ASSERT_FALSE(arms.stops(distance)) << "apart";
        widest = std::max(widest, distance);
      } else {
        const double nearer = distance - random.uniform(0.0, 0.2e-3);
        const bool stopped = arms.stops(nearer);
        ASSERT_EQ(stopped, nearer < widest - ClearanceInterlock::kCloser);
        stops += stopped ? 1 : 0;
        distance = nearer;
        widest = stopped ? nearer : widest;
      }
    }
  }
  EXPECT_GT(stops, 2000);
}

TEST(ClearanceInterlock, StopsArmsWhoseDistanceIsNotKnown) {
  Arms arms;
  EXPECT_EQ(arms.at(std::nan("")).cause, FaultCause::kModel);
  EXPECT_FALSE(arms.stops(5e-3));
  const std::int64_t measured = arms.now;
  for (arms.now += 10 * kMillisecond; arms.now <= measured + 500 * kMillisecond; arms.now += 10 * kMillisecond)
    ASSERT_EQ(arms.interlock.judge({5e-3, measured}, true, arms.now).faults, 0u);
  const FaultRecord late = arms.interlock.judge({5e-3, measured}, true, arms.now);
  EXPECT_EQ(describe(late), "clearance (no answer): 0.51 s, allowed 0.5 s");
}

TEST(ClearanceInterlock, WaitsForTheFirstDistanceForAsLongAsForOthers) {
  ClearanceInterlock interlock(kLeast, kBudget);
  std::int64_t now = 77'000 * kMillisecond;
  const std::int64_t enabled = now;
  for (; now <= enabled + 500 * kMillisecond; now += 10 * kMillisecond)
    ASSERT_EQ(interlock.judge({}, true, now).faults, 0u);
  EXPECT_NE(interlock.judge({}, true, now).faults, 0u);
}

TEST(ClearanceInterlock, IsOffWithoutALeastDistance) {
  ClearanceInterlock interlock(-std::numeric_limits<double>::infinity(), kBudget);
  for (const double distance : {-1.0, 0.0, std::nan("")})
    EXPECT_EQ(interlock.judge({distance, 1}, true, 3'000 * kMillisecond).faults, 0u);
}

}  // namespace
}  // namespace tandem::safety
