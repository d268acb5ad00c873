// SPDX-License-Identifier: Apache-2.0
#include "kinematics/tasks/avoidance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "kinematics/tasks/task_kind.h"
#include "tests/unit/kinematics/arms.h"

namespace tandem::test {
namespace {

using namespace kinematics;

constexpr double kDistance = 0.005;   ///< d of joint limits, m
constexpr double kLeastStable = 0.5;  ///< d of stability

/// Finite limits of rotations, too.
safety::ArmLimits limited(const ConcentricTubeArm& arm) {
  safety::ArmLimits limits = limitsOf(arm);
  for (int j = 0; j < limits.jointCount(); ++j) {
    if (limits.isTranslation(j))
      continue;
    limits.joints[static_cast<std::size_t>(j)].lower = -2.0;
    limits.joints[static_cast<std::size_t>(j)].upper = 2.0;
  }
  return limits;
}

TEST(Avoidance, GradientIsTheDerivativeOfTheNearnessToJointLimits) {
  constexpr double kStep = 1e-8;
  int near = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(300); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const safety::ArmLimits limits = limited(randomArm(random));
    Eigen::VectorXd q = randomInside(limits, random);
    for (Eigen::Index j = q.size() / 2; j < q.size(); ++j)
      q[j] = random.uniform(1.8, 2.05) * (random.chance(0.5) ? 1.0 : -1.0);  // near a limit, or beyond it
    const Avoidance at = jointLimitAvoidance(limits, q, kDistance);
    ASSERT_EQ(at.gradient.size(), q.size());
    EXPECT_EQ(at.cost > 0.0, at.least < kDistance);
    EXPECT_EQ(at.cost > 0.0, !at.gradient.isZero(0.0));
    near += at.cost > 0.0 ? 1 : 0;
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const Eigen::VectorXd by = kStep * Eigen::VectorXd::Unit(q.size(), j);
      const double rate =
          (jointLimitAvoidance(limits, q + by, kDistance).cost - jointLimitAvoidance(limits, q - by, kDistance).cost) /
          (2.0 * kStep);
      EXPECT_NEAR(at.gradient[j], rate, 1e-5) << "joint " << j;
    }
  }
  EXPECT_GT(near, 100);
}

TEST(Avoidance, DistancesAreThoseOfBoxesAndOfNeighbouringTubes) {
  safety::ArmLimits limits;
  limits.joints.resize(4);
  for (int j = 0; j < 4; ++j) {
    limits.joints[static_cast<std::size_t>(j)] = {.lower = -1.0, .upper = 1.0};
    limits.joints[static_cast<std::size_t>(j)].kind =
        j < 2 ? safety::JointKind::kTranslation : safety::JointKind::kRotation;
  }
  limits.rows.resize(1);  // q_0 - q_1 <= -0.001
  limits.rows[0].a.setZero(4);
  limits.rows[0].a.head<2>() << 1.0, -1.0;
  limits.rows[0].b = -0.001;
  Eigen::VectorXd q(4);
  q << -0.998, -0.994, 0.0, 0.98;
  // Box of q_0: 2 mm; row: 3 mm; rotation: 0.02 rad, which counts as 1 mm.
  const Avoidance at = jointLimitAvoidance(limits, q, 4e-3);
  EXPECT_NEAR(at.least, 1e-3, 1e-12);
  EXPECT_NEAR(at.cost, (2.0 * 2.0 + 1.0 * 1.0 + 3.0 * 3.0) / (2.0 * 4.0) * 1e-3, 1e-12);
  EXPECT_NEAR(at.gradient[0], -0.5 + 0.25, 1e-9);
  EXPECT_NEAR(at.gradient[1], -0.25, 1e-9);
  EXPECT_EQ(at.gradient[2], 0.0);
  EXPECT_NEAR(at.gradient[3], 0.75 * kLengthPerRadian, 1e-9);
}

/// Zero with its derivative where the task begins, one from half the distance on, and zero between two limits.
TEST(Avoidance, ActivationBeginsAndEndsSmoothly) {
  safety::ArmLimits limits;
  limits.joints = {{.lower = 0.0, .upper = 1.0}};
  const auto h = [&](double gap) {
    return jointLimitAvoidance(limits, Eigen::VectorXd::Constant(1, gap), kDistance).activation;
  };
  EXPECT_EQ(h(kDistance), 0.0);
  EXPECT_GT(h(0.9 * kDistance), 0.0);
  EXPECT_LT(h(0.999 * kDistance), 2e-5);
  EXPECT_LT(h(0.51 * kDistance), 1.0);
  EXPECT_EQ(h(0.5 * kDistance), 1.0);
  EXPECT_EQ(h(-0.1 * kDistance), 1.0);
  constexpr int kSteps = 1000;
  for (int i = 0; i < kSteps; ++i) {
    const double change = h(kDistance * i / kSteps) - h(kDistance * (i + 1) / kSteps);
    EXPECT_GE(change, 0.0);
    EXPECT_LE(change, 3.0 / kSteps + 1e-12) << "S' = 3/2 at most, over half the distance";
  }
  limits.joints[0].upper = 0.8 * kDistance;
  EXPECT_EQ(h(0.4 * kDistance), 0.0) << "no joint leads away from both";
  EXPECT_GT(h(0.3 * kDistance), 0.0);
}

TEST(Avoidance, GradientIsTheDerivativeOfTheLossOfStability) {
  constexpr double kStep = 1e-6;
  int near = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(600); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const ConcentricTubeArm arm = randomArm(random);
    const auto model = makeArmModel("compliant", arm);
    const Eigen::VectorXd q = randomInside(limitsOf(arm), random);
    Branch branch;
    Tip tip;
    if (model->tip(q, branch, tip) != ModelStatus::kOk || tip.conjugate_points > 0 || tip.stability > kLeastStable ||
        tip.stability < 0.1)
      continue;
    const Avoidance at = stabilityAvoidance(*model, q, branch, tip.stability, kLeastStable);
    EXPECT_EQ(at.least, tip.stability);
    EXPECT_NEAR(at.cost, std::pow(kLeastStable - tip.stability, 2) / (2.0 * kLeastStable), 1e-12);
    // The place of the least determinant, and the sections, must be the same on both sides.
    const auto cost = [&](const Eigen::VectorXd& other) {
      Branch aside = branch;
      Tip there;
      if (model->tip(other, aside, there) != ModelStatus::kOk)
        return std::nan("");  // outside the limits
      return stabilityAvoidance(*model, other, aside, there.stability, kLeastStable).cost;
    };
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const Eigen::VectorXd by = kStep * Eigen::VectorXd::Unit(q.size(), j);
      const double left = (at.cost - cost(q - by)) / kStep, right = (cost(q + by) - at.cost) / kStep;
      if (!(std::abs(right - left) <= 1e-3 * (1.0 + std::abs(at.gradient[j]))))
        continue;  // one-sided
      EXPECT_NEAR(at.gradient[j], 0.5 * (left + right), 1e-4 * (1.0 + std::abs(at.gradient[j]))) << "joint " << j;
      ++near;
    }
  }
  std::printf("  %d derivatives compared\n", near);
  EXPECT_GT(near, 50);
}

TEST(Avoidance, OnlyElasticModelsCanSnap) {
  Random random(1);
  const ConcentricTubeArm arm = randomArm(random);
  EXPECT_FALSE(makeArmModel("rigid", arm)->canSnap());
  EXPECT_TRUE(makeArmModel("compliant", arm)->canSnap());
  const auto rigid = makeArmModel("rigid", arm);
  const Avoidance none = stabilityAvoidance(*rigid, randomInside(limitsOf(arm), random), {}, 1.0, 0.5);
  EXPECT_EQ(none.cost, 0.0);
  EXPECT_EQ(none.activation, 0.0);
}

}  // namespace
}  // namespace tandem::test
