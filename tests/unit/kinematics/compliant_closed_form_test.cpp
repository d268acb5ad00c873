// SPDX-License-Identifier: Apache-2.0
#include <boost/math/special_functions/ellint_1.hpp>
#include <boost/math/special_functions/jacobi_elliptic.hpp>

#include "tests/unit/kinematics/arms.h"
#include "tests/unit/kinematics/end_angle_track.h"
#include "tests/unit/kinematics/two_tubes.h"

namespace tandem::test {
namespace {

using kinematics::Branch;
using kinematics::CompliantModel;
using kinematics::ModelStatus;
using kinematics::Tip;

/// Motors at the entry point keep the tubes opposed: a quarter of the pendulum's period equals the length.
TEST(TwoTubes, BuckleByTheEllipticIntegral) {
  int buckled = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 300; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const TwoTubes tubes(random, 0.0);
    if (tubes.w * tubes.length < 0.51 * std::numbers::pi || tubes.w * tubes.length > 1.4 * std::numbers::pi)
      continue;
    ++buckled;
    Eigen::VectorXd q(4);
    q << 0.0, 0.0, std::numbers::pi, 0.0;
    Branch branch;
    Tip tip;
    ASSERT_EQ(CompliantModel(tubes.arm).tip(q, branch, tip), ModelStatus::kOk);
    const double k = std::abs(std::cos(0.5 * (branch.end_angle[0] - branch.end_angle[1])));
    EXPECT_NEAR(boost::math::ellint_1(k), tubes.w * tubes.length, 1e-6) << "k " << k;
  }
  EXPECT_GT(buckled, 30);
}

TEST(TwoTubes, TwistFollowsThePendulumEquation) {
  int stable = 0, several = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 400; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const TwoTubes tubes(random);
    const double apart = random.uniform(0.05, 6.2), turn = random.uniform(-3.0, 3.0);
    if (tubes.motorByEnd(apart) <= 0.02)
      continue;  // unstable, or almost
    ++stable;
    several += tubes.oppositeDeterminant() < 0.0 ? 1 : 0;
    const Eigen::VectorXd theta = tubes.ends(apart, turn), q = tubes.joints(apart, turn);
    const CompliantModel model(tubes.arm);
    // With several equilibria, the branch selects one.
    Branch branch = tubes.oppositeDeterminant() > 0.0 ? Branch() : TwoTubes::standingAt(q, theta);
    std::vector<kinematics::ShapePoint> shape;
    ASSERT_EQ(model.shape(q, kinematics::Wrench::Zero(), branch, 51, shape), ModelStatus::kOk);
    EXPECT_FALSE(branch.snapped);
    for (int i = 0; i < 2; ++i)
      EXPECT_NEAR(branch.end_angle[i], theta[i], 1e-8);
    for (const auto& point : shape) {
      const auto expected = tubes.at(apart, turn, tubes.length - point.s);
      EXPECT_NEAR(point.psi[0], expected.psi[0], 1e-8) << "s " << point.s;
      EXPECT_NEAR(point.moment[0], expected.moment, 1e-9) << "s " << point.s;
      if (!std::isnan(point.psi[1])) {  // rounding may make one tube end before the other
        EXPECT_NEAR(point.psi[1], expected.psi[1], 1e-8) << "s " << point.s;
        EXPECT_NEAR(point.moment[1], -expected.moment, 1e-9) << "s " << point.s;
      }
    }
  }
  EXPECT_GT(stable, 200);
  EXPECT_GT(several, 30);
}

TEST(TwoTubes, OppositeTubesHaveTheKnownDeterminant) {
  int stable = 0, buckled = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 300; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const TwoTubes tubes(random);
    const double turn = random.uniform(-3.0, 3.0), expected = tubes.oppositeDeterminant();
    const Eigen::VectorXd q = tubes.joints(std::numbers::pi, turn);
    const CompliantModel model(tubes.arm);
    Branch branch;
    Tip tip;
    ASSERT_EQ(model.tip(q, branch, tip), ModelStatus::kOk);
    if (expected > 1e-3) {
      ++stable;
      EXPECT_NEAR(tip.stability, expected, 1e-9);
      EXPECT_LT(twist(branch, q), 1e-8);
    } else if (expected < -1e-3) {
      ++buckled;
      EXPECT_EQ(tip.conjugate_points, 0);
      EXPECT_GT(tip.stability, 0.0);
      const double apart = branch.end_angle[0] - branch.end_angle[1];
      EXPECT_GT(std::abs(apart - std::numbers::pi), 1e-3) << "opposite tubes past the critical length stand on a ridge";
      EXPECT_NEAR(tubes.motors(apart), std::numbers::pi, 1e-7);
    }
  }
  EXPECT_GT(stable, 50);
  EXPECT_GT(buckled, 50);
}

/// Three equal tubes, ending together, at 120 degrees: no bending, and stability is lost in two directions at once.
TEST(ThreeTubes, AlikeAt120DegreesLoseStabilityTwiceAtOnce) {
  int stable = 0, lost = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 200; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    kinematics::Tube tube{1.8e-3, 1.6e-3, 58e9, random.uniform(0.2, 0.5), {}};
    const double curvature = random.uniform(5.0, 30.0), length = random.uniform(0.02, 0.2), behind = 0.3 - length;
    tube.addSection(behind, 0.0);
    tube.addSection(length, curvature);
    kinematics::ConcentricTubeArm arm;
    arm.tubes.assign(3, tube);
    const double turn = random.uniform(-1.0, 1.0), third = 2.0 * std::numbers::pi / 3.0;
    Eigen::VectorXd q(6);
    q << -behind, -behind, -behind, turn, turn + third, turn - third;
    const double k = tube.bendingStiffness(), c = tube.torsionalStiffness(), omega = curvature * std::sqrt(0.5 * k / c);
    const double factor = std::cos(omega * length) - behind * omega * std::sin(omega * length);

    const EndAngleTrack track = trackOf(arm, q, q.tail<3>());
    EXPECT_LT((track.motors - q.tail<3>()).norm(), 1e-12);
    EXPECT_NEAR(track.determinant, factor * factor, 1e-9);
    Tip tip;
    Branch branch;
    const CompliantModel model(arm);
    const double phase = omega * length;
    // The factor's second zero is beyond a phase of pi / 2, its first before it.
    if (factor > 0.05 && phase < 0.5 * std::numbers::pi) {
      ++stable;
      EXPECT_EQ(track.conjugate_points, 0);
      ASSERT_EQ(model.tip(q, branch, tip), ModelStatus::kOk);
      EXPECT_NEAR(tip.stability, factor * factor, 1e-9);
      EXPECT_LT(tip.pose.translation().head<2>().norm(), 1e-12);
    } else if (factor < -0.05 && phase < std::numbers::pi) {
      ++lost;
      EXPECT_EQ(track.conjugate_points, 2);
      EXPECT_NEAR(track.minimum, 0.0, 1e-9) << "the determinant touches zero and turns back";
      ASSERT_EQ(model.tip(q, branch, tip), ModelStatus::kOk);
      EXPECT_EQ(tip.conjugate_points, 0);
      EXPECT_GT(twist(branch, q), 1e-3);
    }
  }
  EXPECT_GT(stable, 20);
  EXPECT_GT(lost, 20);
}

TEST(CompliantStability, IsOneWhereTubesAreAlignedOrDoNotInteract) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 200; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    auto arm = randomArm(random);
    const int n = arm.tubeCount();
    const bool aligned = random.chance(0.5);
    for (int i = 0; i < n; ++i) {
      for (auto& section : arm.tubes[i].sections)
        section.curvature = aligned ? std::abs(section.curvature) : i == 0 ? section.curvature : 0.0;
    }
    Eigen::VectorXd q = jointsAnywhere(arm, random);
    if (aligned)
      q.tail(n).setConstant(q[n]);
    Tip tip;
    Branch branch;
    ASSERT_EQ(CompliantModel(arm).tip(q, branch, tip), ModelStatus::kOk);
    EXPECT_NEAR(tip.stability, 1.0, 1e-12);
    EXPECT_EQ(tip.conjugate_points, 0);
    EXPECT_LT(twist(branch, q), 1e-12);
  }
}

}  // namespace
}  // namespace tandem::test
