// SPDX-License-Identifier: Apache-2.0
#include "kinematics/rigid_model.h"

#include <gtest/gtest.h>

#include "kinematics/constant_curvature.h"
#include "tests/unit/safety/allocation_counter.h"
#include "tests/unit/support/random_tubes.h"

namespace tandem::test {
namespace {

using kinematics::ModelStatus;
using kinematics::RigidModel;
using kinematics::Tip;

/// Tip by integration of R' = R [u(s)]x, p' = R e_z in small steps, with u(s) evaluated at every step: shares only the
/// physics with the model.
Eigen::Isometry3d integrateCurve(const kinematics::ConcentricTubeArm& arm, const Eigen::VectorXd& q, int steps) {
  const int n = arm.tubeCount();
  Eigen::Isometry3d t = arm.base;
  const double length = q[0] + arm.tubes[0].length(), h = length / steps;
  double roll = 0.0;  // direction in which tube 1 bends
  for (int k = 0; k < steps; ++k) {
    const double s = (k + 0.5) * h;
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    double stiffness = 0.0;
    for (int i = 0; i < n; ++i) {
      double end = q[i], angle = q[n + i];
      for (const auto& section : arm.tubes[i].sections) {
        const double begin = end;
        end += section.length;
        angle += section.helix_torsion * (std::min(s, end) - begin);
        if (i == 0)
          roll = angle;
        if (s > end)
          continue;
        stiffness += section.bending_stiffness;
        moment += section.bending_stiffness * section.curvature *
                  (Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) * Eigen::Vector3d::UnitY());
        break;
      }
    }
    const Eigen::Vector3d u = moment / stiffness;
    const Eigen::Matrix3d half =
        Eigen::AngleAxisd(0.5 * h * u.norm(), u.norm() > 0 ? u.normalized() : u.UnitZ()).matrix();
    t.translation() += h * (t.linear() * half.col(2));
    t.linear() = t.linear() * half * half;
  }
  t.linear() = t.linear() * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ());  // the end rotates with tube 1
  return t * arm.tool;
}

TEST(RigidModel, AgreesWithStepByStepIntegration) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 40; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = anyTubes(random);
    const Eigen::VectorXd q = randomInside(limitsOf(arm), random);
    Tip tip;
    const RigidModel model(arm);
    if (model.tip(q, tip) != ModelStatus::kOk)
      continue;  // fully retracted
    const Eigen::Isometry3d expected = integrateCurve(arm, q, 20000);
    EXPECT_LT((tip.pose.translation() - expected.translation()).norm(), 1e-4);
    EXPECT_LT((tip.pose.linear() - expected.linear()).norm(), 1e-3);
  }
}

TEST(RigidModel, JacobianIsTheDerivativeOfThePose) {
  int compared = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 300; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = anyTubes(random);
    const Eigen::VectorXd q = randomInside(limitsOf(arm), random);
    const RigidModel model(arm);
    Tip tip, left, right;
    if (model.tip(q, tip) != ModelStatus::kOk)
      continue;
    for (int j = 0; j < arm.jointCount(); ++j) {
      const double h = 1e-6;
      Eigen::VectorXd a = q, b = q;
      a[j] -= h;
      b[j] += h;
      if (model.tip(a, left) != ModelStatus::kOk || model.tip(b, right) != ModelStatus::kOk)
        continue;
      // If two boundaries are within the difference step, the derivative jumps between them.
      if ((left.jacobian - right.jacobian).cwiseAbs().maxCoeff() > 1e-3)
        continue;
      const Eigen::Vector3d linear = (right.pose.translation() - left.pose.translation()) / (2 * h);
      const Eigen::AngleAxisd turn(right.pose.linear() * left.pose.linear().transpose());
      const Eigen::Vector3d angular = turn.angle() * turn.axis() / (2 * h);
      EXPECT_LT((linear - tip.jacobian.col(j).head<3>()).norm(), 2e-8) << "joint " << j;
      EXPECT_LT((angular - tip.jacobian.col(j).tail<3>()).norm(), 1e-6) << "joint " << j;
      ++compared;
    }
  }
  EXPECT_GT(compared, 1000);
}

TEST(RigidModel, PresetReachesTheDepthsOfThePaper) {
  // The axes of the paper's figures show 165 to 320 mm; Table 1's curvatures as printed would give 17 to 131 mm.
  const RigidModel model(arkArm(0.005));
  const double expected[] = {0.3238, 0.2816, 0.1768};
  for (int c = 0; c < 3; ++c) {
    Tip tip;
    ASSERT_EQ(model.tip(arkStart(c, 0), tip), ModelStatus::kOk);
    EXPECT_NEAR(tip.pose.translation().z(), expected[c], 5e-5);
  }
}

TEST(RigidModel, OneTubeInFrontOfTheOthersIsACircle) {
  auto arm = arkArm(0.0);
  const RigidModel model(arm);
  Eigen::VectorXd q(6);
  q << -0.387, -0.317, -0.199, 0.0, 1.0, 2.0;  // only the curved end of tube 1 is beyond the entry point
  Tip tip;
  ASSERT_EQ(model.tip(q, tip), ModelStatus::kOk);
  const double kappa = 10.0, angle = 0.5;
  EXPECT_NEAR(tip.pose.translation().x(), (1 - std::cos(angle)) / kappa, 1e-12);  // alpha = 0 bends toward +x
  EXPECT_NEAR(tip.pose.translation().y(), 0.0, 1e-12);
  EXPECT_NEAR(tip.pose.translation().z(), std::sin(angle) / kappa, 1e-12);
  EXPECT_EQ(tip.stability, 1.0);
}

TEST(RigidModel, ShapeEndsAtTheTipAndHasNoGaps) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 100; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    auto arm = anyTubes(random);
    const Eigen::VectorXd q = randomInside(limitsOf(arm), random);
    const RigidModel model(arm);
    Tip tip;
    std::vector<kinematics::ShapePoint> shape;
    if (model.tip(q, tip) != ModelStatus::kOk)
      continue;
    ASSERT_EQ(model.shape(q, 101, shape), ModelStatus::kOk);
    ASSERT_EQ(shape.size(), 101u);
    const double roll = q[arm.tubeCount()] + arm.tubes[0].helixAngle(-q[0]);
    EXPECT_TRUE(shape.front().pose.isApprox(arm.base * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()), 1e-12));
    EXPECT_LT(((shape.back().pose * arm.tool).matrix() - tip.pose.matrix()).norm(), 1e-12);
    for (std::size_t i = 1; i < shape.size(); ++i) {
      const double chord = (shape[i].pose.translation() - shape[i - 1].pose.translation()).norm();
      EXPECT_LE(chord, (shape[i].s - shape[i - 1].s) * (1 + 1e-9));
      EXPECT_LE(shape[i].outermost_tube, shape[i - 1].outermost_tube);
    }
  }
}

TEST(RigidModel, RefusesInvalidInput) {
  const RigidModel model(arkArm(0.0));
  Eigen::VectorXd q = arkStart(0, 0);
  Tip tip;
  EXPECT_EQ(model.tip(q.head(5), tip), ModelStatus::kWrongSize);
  q[4] = std::nan("");
  EXPECT_EQ(model.tip(q, tip), ModelStatus::kNotFinite);
  q = arkStart(0, 0);
  q[0] = -0.437;
  EXPECT_EQ(model.tip(q, tip), ModelStatus::kNotExtended);
  q = arkStart(0, 0);
  q[2] = 0.01;
  EXPECT_EQ(model.tip(q, tip), ModelStatus::kProtruded);
  q << -0.3, -0.1, -0.05, 0, 0, 0;
  EXPECT_EQ(model.tip(q, tip), ModelStatus::kInnerInside);
  auto one = arkArm(0.0);
  one.tubes.resize(1);
  EXPECT_THROW(RigidModel{one}, std::invalid_argument);
  EXPECT_THROW(kinematics::makeArmModel("soft", arkArm(0.0)), std::invalid_argument);
}

TEST(RigidModel, AllocatesNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  const RigidModel model(arkArm(0.0));
  const Eigen::VectorXd q = arkStart(1, 0);
  Tip tip;
  const std::size_t before = allocationCount();
  for (int i = 0; i < 100; ++i)
    ASSERT_EQ(model.tip(q, tip), ModelStatus::kOk);
  EXPECT_EQ(allocationCount(), before);
}

TEST(Arc, SeriesAndClosedFormMeet) {
  // Both sides of the switch at an angle of 0.5, and far below it.
  for (const double angle : {1e-9, 1e-3, 0.4999999, 0.5000001, 2.0}) {
    const Eigen::Vector3d u(0.6 * angle / 0.1, 0.8 * angle / 0.1, 0.0), du(0.3, -0.7, 0.0);
    const kinematics::Arc arc(u, 0.1);
    EXPECT_TRUE((arc.rotation() - Eigen::AngleAxisd(angle, u.normalized()).matrix()).norm() < 1e-14);
    const double h = 1e-4;
    const kinematics::Arc left(u - h * du, 0.1), right(u + h * du, 0.1);
    EXPECT_LT((arc.positionDerivative(du) - (right.position() - left.position()) / (2 * h)).norm(), 1e-11);
    const Eigen::AngleAxisd turn(right.rotation() * left.rotation().transpose());
    EXPECT_LT((arc.rotationDerivative(du) - turn.angle() * turn.axis() / (2 * h)).norm(), 1e-10);
  }
}

}  // namespace
}  // namespace tandem::test
