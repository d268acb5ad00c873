// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/kinematics/arms.h"
#include "tests/unit/kinematics/end_angle_track.h"
#include "tests/unit/kinematics/energy_oracle.h"

namespace tandem::test {
namespace {

using kinematics::Branch;
using kinematics::CompliantModel;
using kinematics::ConcentricTubeArm;
using kinematics::ModelStatus;
using kinematics::Tip;

ConcentricTubeArm anyArm(Random& random) {
  if (random.chance(0.5))
    return anyTubes(random);
  return random.chance(0.5) ? longCurved(arkArm(0.0), {0.25, 0.25, 0.18}) : namedArms()[random.integer(0, 3)].arm;
}

/// Any end angles are an equilibrium for some motor angles, often an unstable one.
TEST(CompliantStability, CountsConjugatePointsLikeTheEnergysHessian) {
  int compared = 0, marginal = 0;
  std::array<int, 4> seen{};
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 500; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = anyArm(random);
    const Eigen::VectorXd q = jointsAnywhere(arm, random);
    Eigen::VectorXd theta(arm.tubeCount());
    for (double& angle : theta)
      angle = random.uniform(-std::numbers::pi, std::numbers::pi);
    const EndAngleTrack track = trackOf(arm, q, theta);
    EnergyOracle coarse(arm, q, 2e-3), fine(arm, q, 1e-3);
    const int few = coarse.negativeDirections(coarse.shoot(theta)), many = fine.negativeDirections(fine.shoot(theta));
    EXPECT_LT((fine.motors() - track.motors).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_NEAR(track.minimum, fine.smallestDeterminant(), 1e-3 * std::max(1.0, std::abs(track.minimum)))
        << q.transpose();
    if (few != many || std::abs(fine.baseByEnd().determinant()) < 1e-2) {
      ++marginal;  // a direction with neither positive nor negative curvature
      continue;
    }
    EXPECT_EQ(track.conjugate_points, many) << "theta " << theta.transpose() << "\nq " << q.transpose();
    ++compared;
    ++seen[std::min(many, 3)];
  }
  std::printf("compared %d marginal %d; 0: %d 1: %d 2: %d more: %d\n", compared, marginal, seen[0], seen[1], seen[2],
              seen[3]);
  EXPECT_LT(marginal, compared / 10);
  EXPECT_GT(seen[0], 50);
  EXPECT_GT(seen[1], 30);
  EXPECT_GT(seen[2], 0);
}

TEST(CompliantStability, IsTheMinimumOfTheDeterminant) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 300; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = anyArm(random);
    const Eigen::VectorXd q = jointsAnywhere(arm, random);
    Branch branch;
    Tip tip;
    ASSERT_EQ(CompliantModel(arm).tip(q, branch, tip), ModelStatus::kOk);
    EnergyOracle energy(arm, q, 5e-4);
    const auto psi = energy.shoot(branch.end_angle.head(arm.tubeCount()));
    EXPECT_LT((energy.motors() - q.tail(arm.tubeCount())).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_NEAR(tip.stability, energy.smallestDeterminant(), 1e-4);
    EXPECT_EQ(tip.conjugate_points, 0);
    EXPECT_EQ(energy.negativeDirections(psi), 0);
    EXPECT_LE(tip.stability_at, q[0] + arm.tubes[0].length() + 1e-12);
    EXPECT_GE(tip.stability_at, q.head(arm.tubeCount()).minCoeff() - 1e-12);
  }
}

}  // namespace
}  // namespace tandem::test
