// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/kinematics/neighbourhood.h"

namespace tandem::test {
namespace {

using kinematics::Branch;
using kinematics::CompliantModel;
using kinematics::ConcentricTubeArm;
using kinematics::ModelStatus;
using kinematics::Tip;

struct JacobianTally {
  int compared = 0;
  int vague = 0;  ///< differences that did not converge and are not comparable
  double worst = 0.0;
};

/// Error relative to the column's linear and angular part; parts far below those of other joints are compared with
/// those.
double relativeError(const Eigen::VectorXd& expected, const Eigen::VectorXd& found, double least) {
  const double linear = (expected - found).head<3>().norm() / std::max(least * 0.1, expected.head<3>().norm());
  const double angular = (expected - found).tail<3>().norm() / std::max(least, expected.tail<3>().norm());
  return std::max(linear, angular);
}

void compareColumns(const Neighbourhood& at, int joints, JacobianTally& tally) {
  for (int j = 0; j < joints; ++j) {
    const double step = at.smoothStep(j);
    if (step < 1e-6)
      continue;  // the pose has a corner here; see CoincidentBoundaries
    const Difference difference = differentiate([&](double h) { return at.moved(j, h); }, step);
    const double trust = difference.error;
    if (!(trust < 3e-7)) {
      ++tally.vague;
      continue;
    }
    const double error = relativeError(difference.value, at.tip.jacobian.col(j), 1.0);
    EXPECT_LT(error, 1e-6) << "joint " << j << " stability " << at.tip.stability << " step " << step << "\n expected "
                           << difference.value.transpose() << "\n found " << at.tip.jacobian.col(j).transpose();
    tally.worst = std::max(tally.worst, error);
    ++tally.compared;
  }
}

TEST(CompliantJacobian, IsTheDerivativeForRandomArms) {
  JacobianTally tally;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 250; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = anyTubes(random);
    const CompliantModel model(arm);
    const Eigen::VectorXd q = jointsAnywhere(arm, random, 0.1);
    const Neighbourhood at(model, q);
    ASSERT_EQ(at.status, ModelStatus::kOk);
    compareColumns(at, arm.jointCount(), tally);
  }
  std::printf("compared %d vague %d worst %.2e\n", tally.compared, tally.vague, tally.worst);
  EXPECT_GT(tally.compared, 1000);
  EXPECT_LT(tally.vague, tally.compared / 20);
}

TEST(CompliantJacobian, IsTheDerivativeWhereTubesAreAlignedOrOpposed) {
  JacobianTally tally;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 150; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = random.chance(0.5) ? anyTubes(random) : namedArms()[random.integer(0, 3)].arm;
    const CompliantModel model(arm);
    const int n = arm.tubeCount();
    Eigen::VectorXd q = jointsAnywhere(arm, random, 0.1);
    for (int i = 1; i < n; ++i)
      q[n + i] = q[n] + (random.chance(0.5) ? std::numbers::pi : 0.0);
    const Neighbourhood at(model, q);
    ASSERT_EQ(at.status, ModelStatus::kOk);
    compareColumns(at, arm.jointCount(), tally);
  }
  std::printf("compared %d vague %d worst %.2e\n", tally.compared, tally.vague, tally.worst);
  EXPECT_GT(tally.compared, 500);
  EXPECT_LT(tally.vague, tally.compared / 20);
}

/// Rotates tube 1 until the arm is about to snap: the last joints before that, by bisection.
bool toTheBrink(const CompliantModel& model, double nearness, Eigen::VectorXd& q, Branch& branch) {
  const int alpha = model.arm().tubeCount();
  Tip tip;
  if (model.tip(q, branch, tip) != ModelStatus::kOk)
    return false;
  double step = 0.05;
  for (int k = 0; k < 400 && step > 1e-12; ++k) {
    Eigen::VectorXd next = q;
    next[alpha] += step;
    Branch trial = branch;
    if (model.tip(next, trial, tip) != ModelStatus::kOk || trial.snapped) {
      step *= 0.5;
      continue;
    }
    q = next;
    branch = trial;
    if (tip.stability < nearness)
      return true;
  }
  return false;
}

TEST(CompliantJacobian, IsTheDerivativeNearABifurcation) {
  JacobianTally tally;
  int near = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 120; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = namedArms()[random.integer(2, 3)].arm;
    const CompliantModel model(arm);
    Eigen::VectorXd q = jointsAnywhere(arm, random, 0.0);
    Branch branch;
    if (!toTheBrink(model, std::pow(10.0, random.uniform(-2.5, -0.5)), q, branch))
      continue;
    const Neighbourhood at(model, q, branch);
    ASSERT_EQ(at.status, ModelStatus::kOk);
    ++near;
    for (int j = 0; j < arm.jointCount(); ++j) {
      const double step = at.smoothStep(j);
      if (step < 1e-7)
        continue;
      const Difference difference = differentiate([&](double h) { return at.moved(j, h); }, step);
      const double scale = std::max(1.0, difference.value.size() == 6 ? difference.value.norm() : 1.0);
      if (!(difference.error < 3e-7 * scale)) {
        ++tally.vague;
        continue;
      }
      const double error = (difference.value - at.tip.jacobian.col(j)).norm() / scale;
      EXPECT_LT(error, 1e-6) << "joint " << j << " stability " << at.tip.stability;
      tally.worst = std::max(tally.worst, error);
      ++tally.compared;
    }
  }
  std::printf("near %d compared %d vague %d worst %.2e\n", near, tally.compared, tally.vague, tally.worst);
  EXPECT_GT(near, 20);
  EXPECT_GT(tally.compared, 60);
}

/// Where two boundaries meet the pose has a corner, and the model's derivative is a one-sided one.
TEST(CompliantJacobian, IsOneSidedWhereBoundariesMeet) {
  int compared = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 300; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = anyTubes(random);
    const CompliantModel model(arm);
    const Eigen::VectorXd q = jointsAnywhere(arm, random, 1.0);
    const Neighbourhood at(model, q);
    ASSERT_EQ(at.status, ModelStatus::kOk);
    for (int j = 0; j < arm.tubeCount(); ++j) {
      const auto around = at.room(j);
      if (around.meetings != 1 || around.gap < 1e-5)
        continue;
      const double step = std::min(1e-3 * at.tip.stability, 0.9 * around.gap);
      double best = std::numeric_limits<double>::infinity();
      bool trusted = true;
      for (const double side : {1.0, -1.0}) {
        const Difference difference = differentiate([&](double h) { return at.moved(j, h); }, side * step, true);
        if (difference.value.size() != 6)
          continue;  // a side where tubes would protrude
        trusted = trusted && difference.error < 1e-6;
        best = std::min(best, relativeError(difference.value, at.tip.jacobian.col(j), 1.0));
      }
      if (!trusted || !std::isfinite(best))
        continue;
      EXPECT_LT(best, 3e-6) << "joint " << j << " at " << q.transpose();
      ++compared;
    }
  }
  std::printf("compared %d\n", compared);
  EXPECT_GT(compared, 100);
}

}  // namespace
}  // namespace tandem::test
