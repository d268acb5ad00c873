// SPDX-License-Identifier: Apache-2.0
/** @file Moving limits beta_min and beta_max of equation (1) with the other joints fixed. */
#include <gtest/gtest.h>

#include <cmath>

#include "control/step_problem.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::control {
namespace {

TEST(MovingLimits, EndWhereTheLimitsAreMet) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 300; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    const safety::ArmLimits limits = test::randomLimits(random);
    const safety::ArmLimits* const arms[] = {&limits};
    StepProblem problem;
    problem.setLimits(arms, 1);
    const safety::ArmVector q = test::randomInside(limits, random);
    problem.setPosition(q);
    for (int j = 0; j < limits.jointCount(); ++j) {
      const JointState& joint = problem.joint[static_cast<std::size_t>(j)];
      ASSERT_LE(joint.moving_lower, q[j] + 1e-12);
      ASSERT_GE(joint.moving_upper, q[j] - 1e-12);
      EXPECT_LE(joint.frozen_lower, joint.moving_lower);
      EXPECT_GE(joint.frozen_upper, joint.moving_upper);
      for (const auto& [end, outwards] : {std::pair(joint.moving_lower, -1.0), std::pair(joint.moving_upper, 1.0)}) {
        if (!std::isfinite(end))
          continue;
        safety::ArmVector moved = q;
        moved[j] = end;
        EXPECT_LE(safety::largestViolation(limits, moved), 1e-12);
        moved[j] = end + outwards * 1e-6;
        EXPECT_GT(safety::largestViolation(limits, moved), 0.0);
      }
    }
  }
}

}  // namespace
}  // namespace tandem::control
