// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>

#include "tests/unit/kinematics/arms.h"
#include "tests/unit/kinematics/energy_oracle.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::test {
namespace {

using kinematics::Branch;
using kinematics::CompliantModel;
using kinematics::ConcentricTubeArm;
using kinematics::ModelStatus;
using kinematics::Tip;

/// 10,000 cold starts: each finds a stable equilibrium at the given joints, the same after a full turn of one motor.
void startCold(const ConcentricTubeArm& arm) {
  const CompliantModel model(arm);
  const int n = arm.tubeCount();
  int refused = 0, unstable = 0, different = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 10000; ++seed) {
    Random random(seed);
    const Eigen::VectorXd q = jointsAnywhere(arm, random, 0.2);
    Branch branch;
    Tip tip;
    if (const ModelStatus status = model.tip(q, branch, tip); status != ModelStatus::kOk) {
      ++refused;
      ADD_FAILURE() << describe(status) << ", " << trace(seed) << "\nq " << q.transpose();
      continue;
    }
    unstable += tip.conjugate_points != 0 || tip.stability <= 0.0 ? 1 : 0;
    if (seed % 5 != 0)
      continue;
    Eigen::VectorXd around = q;
    const int turned = random.integer(0, n - 1);
    around[n + turned] += 2.0 * std::numbers::pi * (random.chance(0.5) ? 1.0 : -1.0);
    Tip again;
    ASSERT_EQ(model.tip(around, again), ModelStatus::kOk);
    if ((tip.pose.matrix() - again.pose.matrix()).norm() > 1e-7) {
      ++different;
      EXPECT_LE(different, 2) << trace(seed) << " tube " << turned << " stability " << tip.stability << " and "
                              << again.stability << "\nq " << q.transpose();
    }
  }
  EXPECT_EQ(refused, 0);
  EXPECT_EQ(unstable, 0);
  std::printf("different after a turn: %d of 2000\n", different);
}

TEST(CompliantColdStart, FindsAStableEquilibriumOfArk2024) { startCold(namedArms()[0].arm); }
TEST(CompliantColdStart, FindsAStableEquilibriumOfTimc2024) { startCold(namedArms()[1].arm); }
TEST(CompliantColdStart, FindsAStableEquilibriumOfLongArk2024) { startCold(namedArms()[2].arm); }
TEST(CompliantColdStart, FindsAStableEquilibriumOfLongTimc2024) { startCold(namedArms()[3].arm); }

TEST(CompliantColdStart, FindsAStableEquilibriumOfRandomArms) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 3000; ++seed) {
    Random random(seed);
    const auto arm = anyTubes(random);
    const Eigen::VectorXd q = jointsAnywhere(arm, random);
    Tip tip;
    ASSERT_EQ(CompliantModel(arm).tip(q, tip), ModelStatus::kOk) << trace(seed) << "\nq " << q.transpose();
    EXPECT_EQ(tip.conjugate_points, 0) << trace(seed);
    EXPECT_GT(tip.stability, 0.0) << trace(seed);
  }
}

/// Continuation from untwisted stiff tubes to the real stiffness.
struct Grown {
  bool whole = false;  ///< the equilibrium existed and was stable throughout
  Eigen::VectorXd end_angle;
};

Grown grow(const ConcentricTubeArm& arm, const Eigen::VectorXd& q) {
  constexpr int kSteps = 60;
  const int n = arm.tubeCount();
  Grown result;
  EnergyOracle::Vector theta = q.tail(n), before = theta;
  for (int step = 1; step <= kSteps; ++step) {
    const double softness = static_cast<double>(step) / kSteps;
    ConcentricTubeArm stiff = arm;
    for (auto& tube : stiff.tubes) {
      for (auto& section : tube.sections)
        section.torsional_stiffness /= softness;
    }
    EnergyOracle energy(stiff, q, 4e-3);
    const EnergyOracle::Vector predicted = 2.0 * theta - before;
    before = theta;
    theta = predicted;
    double correction = 1.0;
    for (int iteration = 0; iteration < 8 && correction > 1e-9; ++iteration) {
      energy.shoot(theta);
      const EnergyOracle::Vector fix = energy.baseByEnd().partialPivLu().solve(q.tail(n) - energy.motors());
      correction = fix.cwiseAbs().maxCoeff();
      if (!(correction < 0.1))
        return result;  // the equilibrium ends here, or almost
      theta += fix;
    }
    if (correction > 1e-9 || energy.baseByEnd().determinant() < 1e-3)
      return result;
  }
  result.whole = true;
  result.end_angle = theta;
  return result;
}

TEST(CompliantColdStart, IsConnectedToTheUntwistedEquilibrium) {
  int compared = 0, twisted = 0, different = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 600; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = seed % 3 == 0 ? anyTubes(random) : namedArms()[seed % 3 + 1].arm;
    const Eigen::VectorXd q = jointsAnywhere(arm, random, 0.1);
    const Grown expected = grow(arm, q);
    if (!expected.whole)
      continue;
    Branch branch;
    Tip tip;
    ASSERT_EQ(CompliantModel(arm).tip(q, branch, tip), ModelStatus::kOk);
    ++compared;
    twisted += twist(branch, q) > 0.3 ? 1 : 0;
    const double apart = (branch.end_angle.head(arm.tubeCount()) - expected.end_angle).cwiseAbs().maxCoeff();
    different += apart > 1e-3 ? 1 : 0;
    EXPECT_LT(apart, 1e-3) << "q " << q.transpose() << "\nfound " << branch.end_angle.transpose() << "\nexpected "
                           << expected.end_angle.transpose();
  }
  std::printf("compared %d twisted %d different %d\n", compared, twisted, different);
  EXPECT_GT(compared, 300);
  EXPECT_GT(twisted, 50);
}

TEST(CompliantModel, AllocatesNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  for (const NamedArm& named : namedArms()) {
    const CompliantModel model(named.arm);
    Random random(baseSeed());
    std::vector<Eigen::VectorXd> joints;
    for (int k = 0; k < 300; ++k)
      joints.push_back(jointsAnywhere(named.arm, random));
    Branch branch;
    Tip tip;
    const std::size_t before = allocationCount();
    for (const Eigen::VectorXd& q : joints) {
      ASSERT_EQ(model.tip(q, tip), ModelStatus::kOk);          // cold
      ASSERT_EQ(model.tip(q, branch, tip), ModelStatus::kOk);  // along a path through the whole joint space
      ASSERT_EQ(model.tip(q, branch, tip), ModelStatus::kOk);  // at its present joints
    }
    EXPECT_EQ(allocationCount(), before) << named.name;
  }
}

}  // namespace
}  // namespace tandem::test
