// SPDX-License-Identifier: Apache-2.0
#include "safety/stop_ramp.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/safety/random_arm.h"

namespace tandem::safety {
namespace {

ArmVector randomVelocity(const ArmLimits& limits, test::Random& random) {
  ArmVector v = ArmVector::Zero(limits.jointCount());
  for (Eigen::Index j = 0; j < v.size(); ++j)
    v[j] = random.uniform(-1.0, 1.0) * limits.joints[j].velocity;
  return v;
}

double timeBudget(const ArmLimits& limits, const ArmVector& v) {
  double budget = 0.0;
  for (Eigen::Index j = 0; j < v.size(); ++j) {
    budget = std::max(budget, std::abs(v[j]) / limits.joints[j].stop_deceleration);
  }
  return budget;
}

TEST(StopRamp, StandsWithinItsBudgetAndStaysInsideOnAStraightLine) {
  int shortened = 0;
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 5000; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    const ArmLimits limits = test::randomLimits(random);
    const ArmVector start = test::randomInside(limits, random);
    const ArmVector v0 = randomVelocity(limits, random);
    const double budget = timeBudget(limits, v0);
    StopRamp ramp;
    ramp.start(limits, start, v0);
    ASSERT_LE(ramp.duration(), budget);
    shortened += ramp.duration() < budget * (1.0 - 1e-6) ? 1 : 0;
    const double dt = 1e-3;
    ArmVector q = start;
    ArmVector v = v0;
    double t = 0.0;
    while (!ramp.standing()) {
      ramp.step(dt, q, v);
      t += dt;
      ASSERT_LE(t, budget + dt);
      ASSERT_LE(largestViolation(limits, q), 1e-15);
      const double way = (q - start).dot(v0) / v0.squaredNorm();
      ASSERT_LE((q - start - way * v0).norm(), 1e-12);
    }
    ramp.step(dt, q, v);
    ASSERT_EQ(q, ramp.end());
    ASSERT_EQ(v.norm(), 0.0);
    ASSERT_LE(largestViolation(limits, ramp.end()), 0.0);
  }
  EXPECT_GT(shortened, 100);
}

TEST(StopRamp, GoesHalfTheWayOfFullSpeedWhereThereIsRoom) {
  TubeLimitSpec spec;
  spec.tube_length = {0.4, 0.2};
  spec.carriage_spacing = {0.0};
  spec.minimum_extension = {0.0};
  spec.stage_minimum = {-0.3, -0.2};
  spec.stage_maximum = {0.0, 0.0};
  spec.translation.stop_deceleration = 0.1;
  spec.rotation.stop_deceleration = 20.0;
  const ArmLimits limits = makeTubeLimits(spec);
  ArmVector q(4), v(4);
  q << -0.1, -0.05, 0.0, 0.0;
  v << 0.02, -0.01, 1.0, 0.0;
  StopRamp ramp;
  ramp.start(limits, q, v);
  EXPECT_NEAR(ramp.duration(), 0.2, 1e-15);
  EXPECT_NEAR(ramp.stoppingDistance(0), 0.002, 1e-15);
  EXPECT_NEAR(ramp.stoppingDistance(1), 0.001, 1e-15);
  EXPECT_NEAR(ramp.stoppingDistance(2), 0.1, 1e-15);
  ramp.step(0.1, q, v);
  EXPECT_NEAR(q[0], -0.1 + 0.0015, 1e-15);
  EXPECT_NEAR(v[0], 0.01, 1e-15);
  // The gap of 5 mm between the carriages closes at 50 mm/s: the stop is shortened to 0.2 s, not 0.25 s or more.
  q << -0.1, -0.095, 0.0, 0.0;
  v << 0.05, 0.0, 0.0, 0.0;
  ramp.start(limits, q, v);
  EXPECT_NEAR(ramp.duration(), 0.2, 1e-9);
  EXPECT_NEAR(ramp.stoppingDistance(0), 0.005, 1e-9);
}

TEST(StopRamp, StopsAtOnceWithoutDecelerationOrAtALimit) {
  ArmLimits limits;
  limits.joints.resize(2);
  ArmVector q = ArmVector::Zero(2);
  ArmVector v = ArmVector::Ones(2);
  StopRamp ramp;
  EXPECT_TRUE(ramp.standing());
  ramp.start(limits, q, v);
  EXPECT_TRUE(ramp.standing());
  limits.joints[0].stop_deceleration = 1.0;
  limits.joints[0].upper = 0.0;
  ramp.start(limits, q, v);
  EXPECT_TRUE(ramp.standing());
  ramp.step(1e-3, q, v);
  EXPECT_EQ(q, ArmVector::Zero(2));
  EXPECT_EQ(v, ArmVector::Zero(2));
}

TEST(StopRamp, ARestartOnTheWayEndsAtTheSamePlaceAndTime) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 500; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    const ArmLimits limits = test::randomLimits(random);
    ArmVector q = test::randomInside(limits, random);
    ArmVector v = randomVelocity(limits, random);
    StopRamp first;
    first.start(limits, q, v);
    const double part = random.uniform(0.1, 0.9) * first.duration();
    first.step(part, q, v);
    StopRamp second;
    second.start(limits, q, v);
    ASSERT_NEAR(second.duration(), first.duration() - part, 1e-9);
    ASSERT_LE((second.end() - first.end()).norm(), 1e-9);
  }
}

/// At constant deceleration v^2 / (2 a) is left of the way; less than that before a limit is used up completely.
TEST(StopRamp, BeforeALimitTakesTheWayThatIsLeft) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 500; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    ArmLimits limits = test::randomLimits(random);
    limits.rows.clear();
    limits.joints[0].lower = -1.0;
    limits.joints[0].upper = 0.0;
    const double speed = limits.joints[0].velocity;
    const double whole = speed * speed / (2.0 * limits.joints[0].stop_deceleration),
                 left = random.uniform(0.1, 1.5) * whole;
    ArmVector q = test::randomInside(limits, random), v = ArmVector::Zero(limits.jointCount());
    q[0] = -left;
    v[0] = speed;
    StopRamp ramp;
    ramp.start(limits, q, v);
    const double way = std::min(left, whole);
    EXPECT_NEAR(ramp.stoppingDistance(0), way, 1e-9 * way);
    EXPECT_NEAR(ramp.duration(), 2.0 * way / speed, 1e-9 * ramp.duration());
  }
}

}  // namespace
}  // namespace tandem::safety
