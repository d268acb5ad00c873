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
    const auto arm = random.chance(0.5) ? anyTubes(random) : namedArms()[random.integer(2, 3)].arm;
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
        ++vague;  // the minimum moves to another place within the step
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

/// Two tubes: remaining rotation to both folds of the S-curve, in closed form.
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
    // A random point on the stable part of the curve, with the same sense for both tubes.
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
    // Forward rotation of tube 1 and backward rotation of tube 2 are equivalent.
    const int sense = report.rotation_tube == 0 ? report.rotation_sense : -report.rotation_sense;
    if (std::abs(motors) > 1e-3) {
      EXPECT_EQ(sense, motors > 0.0 ? 1 : -1);
    }
    // The reported rotation causes a snap, and 1 % less does not.
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
TEST(Equilibria, OfTwoTubesAreAllOnTheCurve) {
  int many = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 60; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const TwoTubes tubes(random);
    const double motors = std::numbers::pi + random.uniform(-0.5, 0.5);  // opposed, where there are several
    Eigen::VectorXd q(4);
    q << tubes.beta[0], tubes.beta[1], motors, 0.0;
    std::vector<double> expected;
    constexpr double kStep = 2e-3, kTurn = 2.0 * std::numbers::pi;
    for (double apart = -2.0 * kTurn; apart < 2.0 * kTurn; apart += kStep) {
      if ((tubes.motors(apart) - motors) * (tubes.motors(apart + kStep) - motors) <= 0.0)
        expected.push_back(apart);
    }
    const auto found = CompliantModel(tubes.arm).equilibria(q);
    ASSERT_EQ(found.size(), expected.size()) << "motors " << motors;
    many += found.size() > 1 ? 1 : 0;
    for (const EquilibriumInfo& info : found) {
      const double apart = info.branch.end_angle[0] - info.branch.end_angle[1];
      const auto near = std::lower_bound(expected.begin(), expected.end(), apart - kStep - 1e-6);
      ASSERT_TRUE(near != expected.end() && std::abs(*near - apart) < 2.0 * kStep) << apart;
      if (std::abs(tubes.motorByEnd(apart)) > 1e-3) {
        EXPECT_EQ(info.conjugate_points, tubes.motorByEnd(apart) > 0.0 ? 0 : 1);
      }
    }
  }
  EXPECT_GT(many, 15);
}

/// With increasing stiffness, all but one equilibrium vanish in pairs: those with an even number of conjugate points
/// (among them the stable ones) are one more than the others.
TEST(Equilibria, HaveDegreeOneAndTheirEnergies) {
  int several = 0, incomplete = 0, arms = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 200; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    // Curved almost everywhere, so that most joint vectors have several equilibria.
    const auto arm = random.chance(0.3) ? anyTubes(random) : longCurved(arkArm(0.0), {0.25, 0.25, 0.18});
    const int n = arm.tubeCount();
    const CompliantModel model(arm);
    const Eigen::VectorXd q = jointsAnywhere(arm, random, 0.1);
    const auto found = model.equilibria(q);
    ASSERT_FALSE(found.empty());
    ++arms;
    several += found.size() > 1 ? 1 : 0;
    int degree = 0;
    double first = 0.0;
    for (std::size_t k = 0; k < found.size(); ++k) {
      const EquilibriumInfo& info = found[k];
      const Eigen::VectorXd theta = info.branch.end_angle.head(n);
      const EndAngleTrack track = trackOf(arm, q, theta);
      EXPECT_LT((track.motors - q.tail(n)).cwiseAbs().maxCoeff(), 1e-8);
      EXPECT_EQ(track.conjugate_points, info.conjugate_points);
      EXPECT_NEAR(track.minimum, info.stability, 1e-7 * std::max(1.0, std::abs(track.minimum)));
      EXPECT_TRUE(k == 0 || found[k - 1].energy <= info.energy);
      for (std::size_t other = 0; other < k; ++other)
        EXPECT_GT((found[other].branch.end_angle.head(n) - theta).norm(), 1e-6);
      EnergyOracle energy(arm, q, 2e-4);
      const double value = energy.value(energy.shoot(theta));
      first = k == 0 ? value : first;
      EXPECT_NEAR(info.energy - found[0].energy, value - first, 1e-4 * std::abs(value) + 1e-9);
      degree += info.conjugate_points % 2 == 0 ? 1 : -1;
    }
    incomplete += degree != 1 ? 1 : 0;
    EXPECT_EQ(found[0].conjugate_points, 0) << "the lowest of all is a minimum";
    Branch branch;
    Tip tip;
    ASSERT_EQ(model.tip(q, branch, tip), ModelStatus::kOk);
    EXPECT_TRUE(std::any_of(found.begin(), found.end(), [&](const EquilibriumInfo& info) {
      return (info.branch.end_angle - branch.end_angle).cwiseAbs().maxCoeff() < 1e-6;
    })) << "the cold answer is one of them";
  }
  EXPECT_LE(incomplete, arms / 100);
  EXPECT_GT(several, 20);
}

TEST(EndAngles, AnswerWithoutABoundaryValueProblem) {
  int unstable = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 200; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = random.chance(0.5) ? anyTubes(random) : namedArms()[random.integer(0, 3)].arm;
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
    // The reported motor angles bring the arm to the same tip.
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
