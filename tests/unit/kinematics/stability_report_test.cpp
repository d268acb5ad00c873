// SPDX-License-Identifier: Apache-2.0
#include "kinematics/stability.h"

#include <limits>

#include "tests/unit/kinematics/end_angle_track.h"
#include "tests/unit/kinematics/energy_oracle.h"
#include "tests/unit/kinematics/neighbourhood.h"
#include "tests/unit/kinematics/two_tubes.h"

namespace tandem::test {
namespace {

using kinematics::Branch;
using kinematics::CompliantModel;
using kinematics::EquilibriumInfo;
using kinematics::ModelStatus;
using kinematics::Stability;
using kinematics::Tip;

TEST(StabilityReport, GradientIsTheDerivativeOfTheMinimum) {
  int compared = 0, vague = 0, changing = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 300; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = random.chance(0.5) ? randomArm(random) : namedArms()[random.integer(2, 3)].arm;
    const CompliantModel model(arm);
    const Eigen::VectorXd q = jointsAnywhere(arm, random, 0.1);
    const Neighbourhood at(model, q);
    ASSERT_EQ(at.status, ModelStatus::kOk);
    Branch branch;
    Stability report;
    ASSERT_EQ(model.stability(q, branch, report), ModelStatus::kOk);
    EXPECT_NEAR(report.minimum, at.tip.stability, 1e-9);
    EXPECT_NEAR(report.at, at.tip.stability_at, 1e-6);
    EXPECT_EQ(report.conjugate_points, at.tip.conjugate_points);
    ASSERT_EQ(report.gradient.size(), q.size());
    for (int j = 0; j < arm.jointCount(); ++j) {
      const double step = at.smoothStep(j);
      if (step < 1e-6)
        continue;
      const Difference difference = differentiate([&](double h) { return at.stabilityAt(j, h); }, step);
      if (!(difference.error < 1e-6)) {
        ++vague;  // the smallest value moves to another place on the way
        continue;
      }
      ++compared;
      changing += std::abs(difference.value[0]) > 1e-3 ? 1 : 0;
      EXPECT_NEAR(report.gradient[j], difference.value[0], 1e-6 * std::max(10.0, std::abs(difference.value[0])))
          << "joint " << j << " minimum " << report.minimum << " at " << report.at << "\nq " << q.transpose();
    }
  }
  EXPECT_GT(changing, 200);
  EXPECT_LT(vague, compared / 10);
}

/// Two tubes: what is left to either fold of the S-curve, in closed form.
TEST(StabilityReport, RotationLeftEndsAtTheFold) {
  int several = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 300; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const TwoTubes tubes(random);
    const double opposite = tubes.oppositeDeterminant();
    if (std::abs(opposite) < 0.05 || tubes.w * tubes.length > 1.4)
      continue;
    const double snap = opposite > 0.0 ? std::numeric_limits<double>::infinity() : tubes.snapAngle();
    // Somewhere on the stable part of the curve, the same way round for both tubes.
    const double apart = random.uniform(-0.9, 0.9) * tubes.foldOfEnds();
    const Eigen::VectorXd q = tubes.joints(apart, random.uniform(-1.0, 1.0));
    const CompliantModel model(tubes.arm);
    Branch branch = tubes.standingAt(q, apart);
    Stability report;
    ASSERT_EQ(model.stability(q, branch, report), ModelStatus::kOk);
    const double motors = q[2] - q[3], left = std::min(snap - motors, snap + motors);
    if (left > 2.0 * std::numbers::pi) {
      EXPECT_TRUE(std::isinf(report.rotation_left)) << report.rotation_left << " instead of " << left;
      EXPECT_EQ(report.rotation_sense, 0);
      continue;
    }
    ++several;
    EXPECT_NEAR(report.rotation_left, left, 1e-3);
    ASSERT_NE(report.rotation_sense, 0);
    // Turning tube 1 forwards or tube 2 backwards is the same.
    const int sense = report.rotation_tube == 0 ? report.rotation_sense : -report.rotation_sense;
    if (std::abs(motors) > 1e-3) {
      EXPECT_EQ(sense, motors > 0.0 ? 1 : -1);
    }
    // The turn it names snaps, and 1 % less does not.
    for (const double part : {0.99, 1.01}) {
      Eigen::VectorXd turned = q;
      turned[2 + report.rotation_tube] += part * report.rotation_left * report.rotation_sense;
      Branch moved = tubes.standingAt(q, apart);
      Tip tip;
      ASSERT_EQ(model.tip(turned, moved, tip), ModelStatus::kOk);
      EXPECT_EQ(moved.snapped, part > 1.0);
    }
  }
  EXPECT_GT(several, 30);
}

/// Two tubes: all crossings of the S-curve with the motors' angle.

/// As tubes stiffen, all but one equilibrium vanish in pairs: stable ones and those with an even number of conjugate
/// points are one more than the others.

TEST(EndAngles, AnswerWithoutABoundaryValueProblem) {
  int unstable = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 200; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = random.chance(0.5) ? randomArm(random) : namedArms()[random.integer(0, 3)].arm;
    const int n = arm.tubeCount();
    const CompliantModel model(arm);
    const Eigen::VectorXd ends = jointsAnywhere(arm, random, 0.1);
    Eigen::VectorXd alpha(n);
    Tip tip;
    ASSERT_EQ(model.tipFromEndAngles(ends, alpha, tip), ModelStatus::kOk);
    unstable += tip.conjugate_points > 0 ? 1 : 0;
    for (int j = n; j < 2 * n; ++j) {
      const Difference difference = differentiate(
          [&](double h) -> Eigen::VectorXd {
            Eigen::VectorXd moved = ends, unused(n);
            moved[j] += h;
            Tip there;
            EXPECT_EQ(model.tipFromEndAngles(moved, unused, there), ModelStatus::kOk);
            return poseDifference(tip.pose, there.pose);
          },
          0.05);
      EXPECT_LT(difference.error, 1e-7);
      EXPECT_LT((difference.value - tip.jacobian.col(j)).norm(), 1e-6) << "joint " << j;
    }
    if (tip.conjugate_points > 0)
      continue;
    // The motors it names bring the arm to the same tip.
    Eigen::VectorXd q = ends;
    q.tail(n) = alpha;
    Branch branch;
    branch.known = true;
    branch.q = q;
    branch.end_angle.head(n) = ends.tail(n);
    Tip same;
    ASSERT_EQ(model.tip(q, branch, same), ModelStatus::kOk);
    EXPECT_LT((same.pose.matrix() - tip.pose.matrix()).norm(), 1e-8 / tip.stability);
  }
  EXPECT_GT(unstable, 5);
}

}  // namespace
}  // namespace tandem::test
