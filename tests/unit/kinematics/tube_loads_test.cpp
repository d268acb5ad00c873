// SPDX-License-Identifier: Apache-2.0
#include "kinematics/tube_loads.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "kinematics/compliant_model.h"
#include "tests/unit/kinematics/two_tubes.h"

namespace tandem::kinematics {
namespace {

TubeLoads loadsOf(const ConcentricTubeArm& arm, const Eigen::VectorXd& q, const TubeVector& theta, bool twist = true) {
  Segmentation parts;
  segment(arm, q, parts);
  return tubeLoads(arm, parts, TubeJoints(q).beta, theta, twist);
}

TubeVector padded(const Eigen::Vector2d& ends) {
  TubeVector theta = TubeVector::Zero();
  theta.head<2>() = ends;
  return theta;
}

/// Energy of two tubes in front of the entry point and in their transmissions, from the closed form of their angles, by
/// Simpson's rule.
double energyByQuadrature(const test::TwoTubes& tubes, double apart) {
  constexpr int kPanels = 400;
  const auto& sections = tubes.arm.tubes;
  const double k1 = sections[0].sections.back().bending_stiffness, k2 = sections[1].sections.back().bending_stiffness;
  const double a = sections[0].sections.back().curvature, b = sections[1].sections.back().curvature;
  double sum = 0.0;
  for (int i = 0; i <= kPanels; ++i) {
    const auto state = tubes.at(apart, 0.0, tubes.length * i / kPanels);
    // Two springs in series share the difference of their curvatures.
    const double gap = a * a + b * b - 2.0 * a * b * std::cos(state.psi[0] - state.psi[1]);
    const double density =
        0.5 * k1 * k2 / (k1 + k2) * gap + 0.5 * state.moment * state.moment * (1.0 / tubes.c[0] + 1.0 / tubes.c[1]);
    sum += density * (i == 0 || i == kPanels ? 1.0 : i % 2 == 1 ? 4.0 : 2.0);
  }
  const double moment = tubes.at(apart, 0.0, tubes.length).moment;
  return sum * tubes.length / (3.0 * kPanels) + 0.5 * moment * moment * (tubes.f[0] + tubes.f[1]);
}

/// Bending energy behind the entry point, which no rotation changes.
double guided(const test::TwoTubes& tubes) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 2; ++i) {
    const TubeSection& curved = tubes.arm.tubes[i].sections.back();
    sum += 0.5 * curved.bending_stiffness * curved.curvature * curved.curvature * (curved.length - tubes.length);
  }
  return sum;
}

TEST(TubeLoads, EnergyIsThatOfTheClosedForm) {
  test::Random random(20261);
  for (int k = 0; k < 100; ++k) {
    const test::TwoTubes tubes(random);
    const double apart = random.uniform(-3.1, 3.1);
    const double expected = energyByQuadrature(tubes, apart) + guided(tubes);
    const TubeLoads loads = loadsOf(tubes.arm, tubes.joints(apart, 0.4), padded(tubes.ends(apart, 0.4)));
    ASSERT_NEAR(loads.energy, expected, 1e-6 * expected) << "seed 20261, arm " << k;
  }
}

/// Untwisted tubes of constant curvature exchange concentrated moments alone, apart from what torsion adds.
TEST(TubeLoads, MomentsOfAlignedTubesAreThoseOfTwoSpringsInSeries) {
  test::Random random(20262);
  for (int k = 0; k < 100; ++k) {
    const test::TwoTubes tubes(random, 0.0);  // nothing behind the entry point
    const TubeSection &first = tubes.arm.tubes[0].sections.back(), &second = tubes.arm.tubes[1].sections.back();
    const Eigen::VectorXd q = tubes.joints(0.0, 0.0);
    const TubeLoads loads = loadsOf(tubes.arm, q, padded({0.0, 0.0}), false);
    const double moment = first.bending_stiffness * second.bending_stiffness /
                          (first.bending_stiffness + second.bending_stiffness) *
                          std::abs(first.curvature - second.curvature);
    for (int i = 0; i < 2; ++i) {
      ASSERT_NEAR(loads.couple[i], 2.0 * moment, 1e-9) << "one at the entry point, one at the end";
      ASSERT_NEAR(loads.force[i], 0.0, 1e-9);
    }
  }
}

/// Rigid in torsion, at an angle: t_i' = b_1 b_2 sin(delta) / K and f_i = t_i' |u| are constant; at the entry point
/// n_xy ends with a jump of the same size as their integral.
TEST(TubeLoads, ForcesOfUntwistedTubesFollowFromTheirTorsionalMoments) {
  test::Random random(20263);
  for (int k = 0; k < 100; ++k) {
    const test::TwoTubes tubes(random);
    const TubeSection &first = tubes.arm.tubes[0].sections.back(), &second = tubes.arm.tubes[1].sections.back();
    const double b1 = first.bending_stiffness * first.curvature, b2 = second.bending_stiffness * second.curvature;
    const double total = first.bending_stiffness + second.bending_stiffness, delta = random.uniform(-3.0, 3.0);
    const double u = std::sqrt(b1 * b1 + b2 * b2 + 2.0 * b1 * b2 * std::cos(delta)) / total;
    const double expected = 2.0 * std::abs(b1 * b2 * std::sin(delta) / total) * u * tubes.length;
    const TubeLoads loads = loadsOf(tubes.arm, tubes.joints(0.0, 0.0), padded({delta, 0.0}), false);
    ASSERT_NEAR(loads.force[0], expected, 1e-9 * expected) << "seed 20263, arm " << k;
    ASSERT_NEAR(loads.force[1], expected, 1e-9 * expected) << "action and reaction";
  }
}

TEST(TubeLoads, ForcesBetweenTwistedTubesAreEqualAndOpposite) {
  test::Random random(20265);
  for (int k = 0; k < 100; ++k) {
    const test::TwoTubes tubes(random);
    const double apart = random.uniform(0.2, 3.0);
    const TubeLoads loads = loadsOf(tubes.arm, tubes.joints(apart, 0.0), padded(tubes.ends(apart, 0.0)));
    ASSERT_GT(loads.force[0], 0.0);
    ASSERT_NEAR(loads.force[0], loads.force[1], 1e-9 * loads.force[0]) << "seed 20265, arm " << k;
  }
}

/// Each snap of two tubes releases the difference of the closed form's energies before and after.
TEST(TubeLoads, SnapReleasesTheDifferenceOfTheEnergiesOfBothEquilibria) {
  test::Random random(20264);
  int snaps = 0;
  for (int k = 0; k < 400 && snaps < 40; ++k) {
    const test::TwoTubes tubes(random);
    if (!(tubes.oppositeDeterminant() < -0.02 && tubes.w * tubes.length < 1.2 && tubes.snapAngle() < 5.5))
      continue;
    const CompliantModel model(tubes.arm);
    Branch branch;
    Tip tip;
    const double fold = tubes.foldOfEnds(), motors = tubes.motors(fold);
    Eigen::VectorXd q = tubes.joints(0.0, 0.0);
    q[3] = 0.0;
    double energy = 0.0, distance = 0.0;
    for (int i = 0; i <= 100 && energy == 0.0; ++i) {
      q[2] = (motors + 0.02) * i / 100.0;
      ASSERT_EQ(model.tip(q, branch, tip), ModelStatus::kOk);
      EXPECT_EQ(branch.snapped, branch.snap_energy > 0.0);
      energy = branch.snap_energy;
      distance = branch.snap_distance;
    }
    ASSERT_GT(energy, 0.0) << "seed 20264, arm " << k;
    // The other equilibrium with the same motors, on the branch that is wound a turn further: it is that of the
    // mirrored angles 2 pi - apart with motors 2 pi - motors.
    const double turn = 2.0 * std::numbers::pi;
    double low = 0.0, high = fold;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      (tubes.motors(middle) < turn - motors ? low : high) = middle;
    }
    const double expected = energyByQuadrature(tubes, fold) - energyByQuadrature(tubes, low);
    EXPECT_NEAR(energy, expected, 2e-3 * expected + 1e-9) << "seed 20264, arm " << k;
    EXPECT_GT(distance, 0.0);
    ++snaps;
  }
  std::printf("snaps %d\n", snaps);
  EXPECT_GE(snaps, 10);
}

}  // namespace
}  // namespace tandem::kinematics
