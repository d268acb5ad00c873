// SPDX-License-Identifier: Apache-2.0
#include "safety/joint_motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/safety/random_arm.h"

namespace tandem::safety {
namespace {

TEST(JointMotion, KeepsSpeedsAccelerationsAndLimitsFromRestToRest) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 500; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    const ArmLimits limits = test::randomLimits(random);
    const ArmVector q0 = test::randomInside(limits, random);
    const ArmVector q1 = test::randomInside(limits, random);
    const JointMotion motion(limits, q0, q1);
    const int n = limits.jointCount();
    EXPECT_EQ(motion.position(0.0), q0);
    EXPECT_EQ(motion.position(motion.duration()), q1);
    EXPECT_EQ(motion.velocity(0.0).norm(), 0.0);
    EXPECT_LE(motion.velocity(motion.duration()).norm(), 1e-12);
    EXPECT_TRUE(motion.finished(motion.duration()));
    const int steps = 400;
    const double dt = motion.duration() / steps;
    ArmVector last = q0;
    for (int i = 1; i <= steps; ++i) {
      const ArmVector q = motion.position(i * dt);
      const ArmVector middle = motion.velocity((i - 0.5) * dt);
      ASSERT_LE(largestViolation(limits, q), 1e-12);
      for (Eigen::Index j = 0; j < n; ++j) {
        const double acceleration = 2 * j < n ? kMoveTranslationAcceleration : kMoveRotationAcceleration;
        ASSERT_LE(std::abs(motion.velocity(i * dt)[j]), limits.joints[j].velocity * (1 + 1e-9));
        ASSERT_LE(std::abs(motion.velocity(i * dt)[j] - motion.velocity((i - 1) * dt)[j]),
                  acceleration * dt * (1 + 1e-6) + 1e-12);
        // Velocity is the derivative of position, except in the interval with a corner of the trapezoid.
        ASSERT_NEAR((q[j] - last[j]) / dt, middle[j], acceleration * dt);
      }
      last = q;
    }
  }
}

TEST(JointMotion, TakesDefaultsWhereSpeedsAreFree) {
  ArmLimits limits;
  limits.joints.resize(2);
  limits.joints[1].kind = JointKind::kRotation;
  ArmVector q0 = ArmVector::Zero(2);
  ArmVector q1(2);
  q1 << 0.05, 0.0;
  // 0.5 s to 10 mm/s and back, 2.5 mm each, 45 mm at full speed.
  EXPECT_NEAR(JointMotion(limits, q0, q1).duration(), 5.5, 1e-12);
  q1 << 0.0, 0.25;
  // Too short to reach 0.5 rad/s at 1 rad/s^2 for long: 0.5 s up and 0.5 s down.
  EXPECT_NEAR(JointMotion(limits, q0, q1).duration(), 1.0, 1e-12);
  limits.joints[1].slew_limit = 0.25;
  EXPECT_NEAR(JointMotion(limits, q0, q1).duration(), 2.0, 1e-12);
}

TEST(JointMotion, NowhereToGoTakesNoTime) {
  ArmLimits limits;
  limits.joints.resize(2);
  const ArmVector q = ArmVector::Ones(2);
  const JointMotion motion(limits, q, q);
  EXPECT_EQ(motion.duration(), 0.0);
  EXPECT_EQ(motion.position(0.0), q);
  EXPECT_EQ(motion.velocity(0.0).norm(), 0.0);
}

TEST(JointMotion, SpeedGoesByTheKindOfAJointNotByItsNumber) {
  ArmLimits limits;
  limits.joints.resize(3);
  limits.joints[0].kind = limits.joints[1].kind = JointKind::kRotation;
  EXPECT_EQ(moveVelocity(limits, 0), kMoveRotationVelocity);
  EXPECT_EQ(moveVelocity(limits, 1), kMoveRotationVelocity);
  EXPECT_EQ(moveVelocity(limits, 2), kMoveTranslationVelocity);
}

}  // namespace
}  // namespace tandem::safety
