// SPDX-License-Identifier: Apache-2.0
#include "planning/error_statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "planning/follower.h"

namespace tandem::test {
namespace {

using planning::ErrorStatistics;

TEST(ErrorStatistics, AreThoseOfTheSortedErrors) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < 20; ++round) {
    ErrorStatistics statistics;
    std::vector<double> errors(1 + random() % 3000);
    double squares = 0.0;
    for (double& error : errors) {
      error = std::pow(10.0, std::uniform_real_distribution(-8.0, -1.0)(random));
      statistics.add(error);
      squares += error * error;
    }
    std::ranges::sort(errors);
    EXPECT_EQ(statistics.count(), errors.size());
    EXPECT_EQ(statistics.maximum(), errors.back());
    EXPECT_NEAR(statistics.rms(), std::sqrt(squares / static_cast<double>(errors.size())), 1e-12);
    for (const double fraction : {0.05, 0.5, 0.95, 1.0}) {
      const auto rank = static_cast<std::size_t>(std::ceil(fraction * static_cast<double>(errors.size())));
      const double exact = errors[rank - 1], found = statistics.percentile(fraction);
      EXPECT_GE(found, exact * (1.0 - 1e-9)) << fraction << " of " << errors.size();
      EXPECT_LE(found, exact * 1.0101) << fraction << " of " << errors.size();
    }
  }
}

TEST(ErrorStatistics, OfNothingAndOfExtremesAreFinite) {
  ErrorStatistics statistics;
  EXPECT_EQ(statistics.rms(), 0.0);
  EXPECT_EQ(statistics.percentile(0.95), 0.0);
  statistics.add(0.0);
  EXPECT_EQ(statistics.percentile(0.95), 0.0);
  statistics.add(50.0);
  EXPECT_EQ(statistics.percentile(1.0), 50.0);
}

/// A tip that lags by a known amount, point by point and by time.
TEST(ErrorStatistics, OfARunAreThoseOfItsTasks) {
  for (const auto following : {planning::Following::kPointByPoint, planning::Following::kTimed}) {
    constexpr double kLag = 2e-4, kPeriod = 0.1;
    planning::TrajectorySpec spec;
    spec.shape = planning::Line{{0, 0, 0.01}};
    spec.point_count = 10;
    spec.following = following;
    spec.speed = 4e-3;
    spec.acceleration = 2e-3;
    planning::Follower follower(kPeriod);
    const Eigen::Vector3d start(0, 0, 0.3), relative(0, 0.01, 0);
    follower.start(spec, {start, relative});
    planning::Reference reference;
    Eigen::Vector3d tip = start;
    while (follower.update({tip, relative}, reference))
      tip = reference.tasks[1].position + Eigen::Vector3d(kLag, 0, 0);
    ASSERT_EQ(follower.errors().size(), 2u);
    const planning::ErrorStatistics &between = follower.errors()[0], &of_tip = follower.errors()[1];
    EXPECT_GE(of_tip.count(), following == planning::Following::kTimed ? 20u : 10u);
    EXPECT_EQ(between.count(), of_tip.count());
    EXPECT_EQ(between.maximum(), 0.0);
    EXPECT_NEAR(of_tip.rms(), kLag, 1e-9);
    EXPECT_NEAR(of_tip.maximum(), kLag, 1e-9);
  }
}

}  // namespace
}  // namespace tandem::test
