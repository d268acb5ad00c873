// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/kinematics/energy_oracle.h"
#include "tests/unit/kinematics/two_tubes.h"

namespace tandem::test {
namespace {

using kinematics::Branch;
using kinematics::CompliantModel;
using kinematics::ModelStatus;
using kinematics::Tip;

double energyOf(const kinematics::ConcentricTubeArm& arm, const Eigen::VectorXd& q, const Branch& branch) {
  EnergyOracle energy(arm, q, 5e-4);
  return energy.value(energy.shoot(branch.end_angle.head(arm.tubeCount())));
}

/// Two tubes whose S-curve has one fold: they snap, and only once per turn.
bool snaps(const TwoTubes& tubes) {
  return tubes.oppositeDeterminant() < -0.02 && tubes.w * tubes.length < 1.2 && tubes.snapAngle() < 5.5;
}

/// A full turn of tube 1 back and forth: two tubes snap exactly where their equilibrium ends in closed form.
TEST(CompliantBranch, FollowsASlowTurnAndSnapsWhereTheDeterminantVanishes) {
  int arms = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 400 && arms < 20; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const TwoTubes tubes(random);
    if (!snaps(tubes))
      continue;
    ++arms;
    const double snap = tubes.snapAngle(), turn = 2.0 * std::numbers::pi;
    const CompliantModel model(tubes.arm);
    Eigen::VectorXd q(4);
    q << tubes.beta[0], tubes.beta[1], 0.0, 0.0;
    Branch branch;
    Tip tip;
    ASSERT_EQ(model.tip(q, branch, tip), ModelStatus::kOk);
    constexpr int kSteps = 720;
    std::vector<double> there(kSteps + 1), back(kSteps + 1);
    int snapped_there = 0, snapped_back = 0;
    for (int k = 0; k <= 2 * kSteps; ++k) {
      const bool forth = k <= kSteps;
      const int place = forth ? k : 2 * kSteps - k;
      const Branch before = branch;
      const Eigen::VectorXd last = q;
      q[2] = turn * place / kSteps;
      ASSERT_EQ(model.tip(q, branch, tip), ModelStatus::kOk);
      EXPECT_EQ(tip.conjugate_points, 0);
      (forth ? there : back)[place] = branch.end_angle[0] - branch.end_angle[1];
      if (!branch.snapped)
        continue;
      ++(forth ? snapped_there : snapped_back);
      const double expected = forth ? snap : turn - snap;
      EXPECT_LE(std::min(q[2], last[2]), expected + 1e-6);
      EXPECT_GE(std::max(q[2], last[2]), expected - 1e-6);
      // The new branch existed before, with a lower energy.
      Branch other = branch;
      ASSERT_EQ(model.tip(last, other, tip), ModelStatus::kOk);
      EXPECT_FALSE(other.snapped);
      EXPECT_LT(energyOf(tubes.arm, last, other), energyOf(tubes.arm, last, before));
    }
    EXPECT_EQ(snapped_there, 1);
    EXPECT_EQ(snapped_back, 1);
    EXPECT_GT(there[kSteps / 2 + 1] - back[kSteps / 2 + 1], -turn);
    EXPECT_GT(std::abs(there[kSteps / 2] - back[kSteps / 2]), 0.1) << "opposite motors, two equilibria";
    EXPECT_NEAR(there[kSteps], turn, 1e-6) << "a whole turn arrives at the ends";
    EXPECT_NEAR(back[0], 0.0, 1e-6);
  }
  EXPECT_EQ(arms, 20);
}

struct Walk {
  Branch branch;
  int snaps = 0;
};

Walk walk(const CompliantModel& model, const Eigen::VectorXd& from, const Eigen::VectorXd& to, int steps) {
  Walk result;
  Tip tip;
  EXPECT_EQ(model.tip(from, result.branch, tip), ModelStatus::kOk);
  for (int k = 1; k <= steps; ++k) {
    const Eigen::VectorXd q = k == steps ? to : Eigen::VectorXd(from + (to - from) * k / steps);
    EXPECT_EQ(model.tip(q, result.branch, tip), ModelStatus::kOk);
    result.snaps += result.branch.snapped ? 1 : 0;
  }
  return result;
}

TEST(CompliantBranch, BigStepsAndSmallStepsArriveOnTheSameBranch) {
  int paths = 0, snapped = 0, different = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 200; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = random.chance(0.3) ? anyTubes(random) : namedArms()[random.integer(0, 3)].arm;
    const CompliantModel model(arm);
    const Eigen::VectorXd from = jointsAnywhere(arm, random, 0.1);
    Eigen::VectorXd to = jointsAnywhere(arm, random, 0.1);
    to.tail(arm.tubeCount()) *= 2.0;
    const Walk one = walk(model, from, to, 1), few = walk(model, from, to, 7), many = walk(model, from, to, 400);
    ++paths;
    snapped += many.snaps > 0 ? 1 : 0;
    EXPECT_EQ(one.snaps > 0, many.snaps > 0) << many.snaps << " snaps in small steps";
    const double apart = (one.branch.end_angle - many.branch.end_angle).cwiseAbs().maxCoeff() +
                         (few.branch.end_angle - many.branch.end_angle).cwiseAbs().maxCoeff();
    different += apart > 1e-6 ? 1 : 0;
    EXPECT_LT(apart, 1e-6) << "one step " << one.branch.end_angle.transpose() << "\nsmall steps "
                           << many.branch.end_angle.transpose() << "\nfrom " << from.transpose() << "\nto "
                           << to.transpose() << "\nsnaps " << one.snaps << " " << few.snaps << " " << many.snaps;
  }
  std::printf("paths %d snapped %d different %d\n", paths, snapped, different);
  EXPECT_GT(snapped, 10);
}

/// Along a smooth path the pose does not jump unless the branch reports it.
TEST(CompliantBranch, JumpsOnlyWhereItReportsASnap) {
  int snaps = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 60; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = namedArms()[random.integer(2, 3)].arm;
    const CompliantModel model(arm);
    const Eigen::VectorXd from = jointsAnywhere(arm, random, 0.1);
    Eigen::VectorXd to = jointsAnywhere(arm, random, 0.1);
    to.tail(arm.tubeCount()) *= 6.0;
    Branch branch;
    Tip last, tip;
    ASSERT_EQ(model.tip(from, branch, last), ModelStatus::kOk);
    constexpr int kSteps = 4000;
    for (int k = 1; k <= kSteps; ++k) {
      const Eigen::VectorXd q = from + (to - from) * k / kSteps;
      ASSERT_EQ(model.tip(q, branch, tip), ModelStatus::kOk);
      const double moved = (tip.pose.translation() - last.pose.translation()).norm();
      const Eigen::VectorXd step = (to - from) / kSteps;
      const double predicted =
          std::max((last.jacobian * step).head<3>().norm(), (tip.jacobian * step).head<3>().norm());
      if (branch.snapped)
        ++snaps;
      else
        EXPECT_LT(moved, 3.0 * predicted + 1e-3)
            << "q " << q.transpose() << " stability " << last.stability << " to " << tip.stability;
      last = tip;
    }
  }
  std::printf("snaps %d\n", snaps);
  EXPECT_GT(snaps, 10);
}

}  // namespace
}  // namespace tandem::test
