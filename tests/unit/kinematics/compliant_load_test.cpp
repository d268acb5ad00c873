// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/kinematics/arms.h"
#include "tests/unit/kinematics/boundary_value_oracle.h"
#include "tests/unit/kinematics/differences.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::test {
namespace {

using kinematics::Branch;
using kinematics::CompliantModel;
using kinematics::ConcentricTubeArm;
using kinematics::LoadedTip;
using kinematics::ModelStatus;
using kinematics::ShapePoint;
using kinematics::Tip;
using kinematics::Wrench;

/// A wrench that bends tube 1 visibly, of size K / L^2 and K / L; pi^2 / 4 of that buckles a straight column.
Wrench anyWrench(const ConcentricTubeArm& arm, const Eigen::VectorXd& q, Random& random) {
  const double length = q[0] + arm.tubes[0].length(), k = arm.tubes[0].sections.back().bending_stiffness;
  Wrench wrench;
  wrench << anyVector(random, k / (length * length)), anyVector(random, k / length);
  return wrench;
}

/// Straight tubes, all with the same length beyond the entry point.
ConcentricTubeArm straightArm(Random& random, double length, Eigen::VectorXd& q) {
  auto arm = anyTubes(random);
  arm.base.setIdentity();
  arm.tool.setIdentity();
  const int n = arm.tubeCount();
  q = Eigen::VectorXd::Zero(2 * n);
  for (int i = 0; i < n; ++i) {
    const double behind = random.uniform(0.01, 0.2);
    arm.tubes[i].sections.clear();
    arm.tubes[i].addSection(length + behind, 0.0);
    q[i] = length - arm.tubes[i].length();
  }
  return arm;
}

double stiffnessOf(const ConcentricTubeArm& arm) {
  double sum = 0.0;
  for (const auto& tube : arm.tubes)
    sum += tube.bendingStiffness();
  return sum;
}

TEST(CompliantLoad, AgreesWithShooting) {
  int compared = 0, stood = 0;
  double deflection = 0.0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 200; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = random.chance(0.6) ? anyTubes(random) : namedArms()[random.integer(0, 3)].arm;
    const Eigen::VectorXd q = jointsAnywhere(arm, random, 0.3);
    const Wrench wrench = anyWrench(arm, q, random);
    const CompliantModel model(arm);
    Branch branch;
    LoadedTip tip;
    if (const ModelStatus status = model.loadedTip(q, wrench, branch, tip); status != ModelStatus::kOk) {
      ADD_FAILURE() << describe(status) << "\nq " << q.transpose() << "\nwrench " << wrench.transpose();
      continue;
    }
    stood += tip.conjugate_points == 0 ? 1 : 0;
    std::vector<ShapePoint> shape;
    ASSERT_EQ(model.shape(q, wrench, branch, 3, shape), ModelStatus::kOk);
    EXPECT_LT(((shape.back().pose * arm.tool).matrix() - tip.pose.matrix()).norm(), 1e-7);
    Eigen::VectorXd guess = Eigen::VectorXd::Zero(arm.tubeCount());
    for (int i = 0; i < arm.tubeCount(); ++i)
      guess[i] = std::isnan(shape.front().moment[i]) ? 0.0 : shape.front().moment[i];
    const auto expected = BoundaryValueOracle(arm).solve(q, guess, wrench, tip.pose.translation());
    ASSERT_TRUE(expected.converged) << "residual " << expected.residual;
    EXPECT_LT((tip.pose.translation() - expected.tip.translation()).norm(), 1e-7) << q.transpose();
    EXPECT_LT(turned(tip.pose.linear(), expected.tip.linear()), 1e-6);
    Tip unloaded;
    ASSERT_EQ(model.tip(q, unloaded), ModelStatus::kOk);
    deflection = std::max(deflection, (tip.pose.translation() - unloaded.pose.translation()).norm());
    ++compared;
  }
  EXPECT_GT(deflection, 0.05);
  EXPECT_GT(stood, compared * 9 / 10);
}

TEST(CompliantLoad, OfNothingIsTheUnloadedArm) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 200; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = anyTubes(random);
    const Eigen::VectorXd q = jointsAnywhere(arm, random, 0.2);
    const CompliantModel model(arm);
    Tip unloaded;
    Branch branch;
    LoadedTip none, little;
    ASSERT_EQ(model.tip(q, branch, unloaded), ModelStatus::kOk);
    Branch cold;
    ASSERT_EQ(model.loadedTip(q, Wrench::Zero(), cold, none), ModelStatus::kOk);
    EXPECT_LT((none.pose.matrix() - unloaded.pose.matrix()).norm(), 1e-8);
    EXPECT_LT((none.jacobian - unloaded.jacobian).norm(), 1e-6 * unloaded.jacobian.norm());
    EXPECT_NEAR(none.stability, unloaded.stability, 1e-6);
    EXPECT_LT((none.compliance - none.compliance.transpose()).norm(), 1e-7 * none.compliance.norm());
    const Wrench wrench = 1e-6 * anyWrench(arm, q, random);
    ASSERT_EQ(model.loadedTip(q, wrench, branch, little), ModelStatus::kOk);
    const Wrench moved = poseDifference(unloaded.pose, little.pose), linear = none.compliance * wrench;
    EXPECT_LT((moved - linear).norm(), 1e-3 * linear.norm() + 1e-9);
  }
}

TEST(CompliantLoad, StraightTubesAreACantilever) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 100; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const double length = random.uniform(0.05, 0.2);
    Eigen::VectorXd q;
    const auto arm = straightArm(random, length, q);
    const double k = stiffnessOf(arm);
    const CompliantModel model(arm);
    Branch branch;
    LoadedTip tip;
    ASSERT_EQ(model.loadedTip(q, Wrench::Zero(), branch, tip), ModelStatus::kOk);
    Eigen::Matrix<double, 6, 6> expected = Eigen::Matrix<double, 6, 6>::Zero();
    expected(0, 0) = expected(1, 1) = std::pow(length, 3) / (3.0 * k);
    expected(3, 3) = expected(4, 4) = length / k;
    expected(0, 4) = expected(4, 0) = length * length / (2.0 * k);
    expected(1, 3) = expected(3, 1) = -length * length / (2.0 * k);
    expected(5, 5) = arm.tubes[0].length() / arm.tubes[0].torsionalStiffness();  // only tube 1 carries the tool
    EXPECT_LT((tip.compliance - expected).cwiseAbs().maxCoeff(), 1e-9 * expected.cwiseAbs().maxCoeff());
    // A pure moment bends it to an arc, for any angle.
    const double moment = random.uniform(-3.0, 3.0) * k / length, curvature = moment / k;
    Wrench wrench = Wrench::Zero();
    wrench[4] = moment;
    Branch bent;
    ASSERT_EQ(model.loadedTip(q, wrench, bent, tip), ModelStatus::kOk);
    EXPECT_NEAR(tip.pose.translation().x(), (1.0 - std::cos(curvature * length)) / curvature, 1e-8);
    EXPECT_NEAR(tip.pose.translation().z(), std::sin(curvature * length) / curvature, 1e-8);
  }
}

/// Euler's column: straight up to pi^2 K / (4 L^2), bent beyond.
TEST(CompliantLoad, BucklesLikeAColumn) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 60; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const double length = random.uniform(0.05, 0.2);
    Eigen::VectorXd q;
    const auto arm = straightArm(random, length, q);
    const double critical = std::numbers::pi * std::numbers::pi * stiffnessOf(arm) / (4.0 * length * length);
    const CompliantModel model(arm);
    for (const double part : {0.9, 0.99, 1.01, 1.2}) {
      Wrench wrench = Wrench::Zero();
      wrench[2] = -part * critical;
      Branch branch;
      LoadedTip tip;
      ASSERT_EQ(model.loadedTip(q, wrench, branch, tip), ModelStatus::kOk) << part;
      const double aside = tip.pose.translation().head<2>().norm();
      if (part < 1.0) {
        EXPECT_LT(aside, 1e-9);
        EXPECT_EQ(tip.conjugate_points, 0);
        EXPECT_GT(tip.stability, 0.0);
      } else {
        EXPECT_TRUE(tip.conjugate_points > 0 || aside > 1e-3 * length)
            << "a straight column past the critical load is called stable";
      }
    }
  }
}

TEST(CompliantLoad, JacobianAndComplianceAreDerivatives) {
  int compared = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 60; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = random.chance(0.5) ? anyTubes(random) : namedArms()[random.integer(0, 1)].arm;
    const Eigen::VectorXd q = jointsAnywhere(arm, random, 0.0);
    const Wrench wrench = 0.5 * anyWrench(arm, q, random);
    const CompliantModel model(arm);
    Branch branch;
    LoadedTip tip;
    ASSERT_EQ(model.loadedTip(q, wrench, branch, tip), ModelStatus::kOk);
    if (tip.conjugate_points > 0 || tip.stability < 0.05)
      continue;
    const auto moved = [&](const Eigen::VectorXd& there, const Wrench& load) -> Eigen::VectorXd {
      Branch near = branch;
      LoadedTip other;
      if (model.loadedTip(there, load, near, other) != ModelStatus::kOk || near.snapped)
        return {};
      return poseDifference(tip.pose, other.pose);
    };
    for (int j = 0; j < 6; ++j) {
      const double scale = j < 3 ? 0.02 : 1e-3;
      const Difference difference = differentiate([&](double h) { return moved(q, wrench + h * Wrench::Unit(j)); },
                                                  scale * std::min(1.0, tip.stability));
      const double size = tip.compliance.col(j).norm();
      if (!(difference.error < 1e-7 * size))
        continue;
      ++compared;
      EXPECT_LT((difference.value - tip.compliance.col(j)).norm(), 1e-6 * size) << "wrench " << j;
    }
    for (int j = 0; j < arm.jointCount(); ++j) {
      const double step = j < arm.tubeCount() ? std::min(1e-4, -0.5 * q[j]) : 0.02 * std::min(1.0, tip.stability);
      if (step < 1e-6)
        continue;
      const Difference difference =
          differentiate([&](double h) { return moved(q + h * Eigen::VectorXd::Unit(q.size(), j), wrench); }, step);
      if (!(difference.error < 3e-7))
        continue;  // a corner within the step
      ++compared;
      EXPECT_LT((difference.value - tip.jacobian.col(j)).norm(), 1e-6 * std::max(1.0, difference.value.norm()))
          << "joint " << j;
    }
  }
  EXPECT_GT(compared, 500);
}

/// Betti's law. A force of constant direction has a potential, so the compliance is symmetric; a moment of constant
/// direction has none: the stiffness's antisymmetric part is that of the moment's cross product.
TEST(CompliantLoad, IsReciprocal) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 100; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = anyTubes(random);
    const Eigen::VectorXd q = jointsAnywhere(arm, random, 0.2);
    const CompliantModel model(arm);
    Wrench wrench = anyWrench(arm, q, random);
    if (seed % 2 == 0)
      wrench.tail<3>().setZero();
    Branch branch;
    LoadedTip tip;
    EXPECT_EQ(model.loadedTip(q, wrench, branch, tip), ModelStatus::kOk);
    const auto& c = tip.compliance;
    Eigen::Matrix3d cross;
    cross << 0, -wrench[5], wrench[4], wrench[5], 0, -wrench[3], -wrench[4], wrench[3], 0;
    const Eigen::Matrix<double, 3, 6> turns = c.bottomRows<3>();
    const Eigen::Matrix<double, 6, 6> expected = turns.transpose() * cross * turns;
    const Eigen::Matrix<double, 6, 6> found = c - c.transpose();
    EXPECT_LT(std::min((found - expected).norm(), (found + expected).norm()), 1e-6 * c.norm());
  }
}

/// What a warm start predicts from.
TEST(CompliantLoad, BranchHasTheDerivativesOfItsUnknowns) {
  int compared = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 60; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = anyTubes(random);
    const Eigen::VectorXd q = jointsAnywhere(arm, random, 0.0);
    const Wrench wrench = 0.3 * anyWrench(arm, q, random);
    const CompliantModel model(arm);
    const int n = arm.tubeCount();
    const auto at = [&](const Eigen::VectorXd& there, const Wrench& load) {
      Branch branch;
      LoadedTip tip;
      EXPECT_EQ(model.loadedTip(there, load, branch, tip), ModelStatus::kOk);
      return branch;
    };
    const Branch middle = at(q, wrench);
    const Eigen::Matrix3d base = arm.base.linear();  // a branch keeps quantities of the arm's base frame
    const auto compare = [&](const Branch& less, const Branch& more, double step, const Eigen::VectorXd& expected) {
      Eigen::VectorXd change(7);
      const Eigen::AngleAxisd turn(Eigen::Matrix3d(more.end_frame * less.end_frame.transpose()));
      change << more.end_angle - less.end_angle, turn.angle() * turn.axis();
      if (!(change.norm() < 0.1))
        return;  // another equilibrium
      EXPECT_LT((change / (2.0 * step) - expected).norm(), 1e-3 * expected.norm() + 1e-4);
      ++compared;
    };
    for (int j = 0; j < 6; ++j) {
      const double step = 1e-4 / middle.by_load.col(j).norm();
      Wrench aside = Wrench::Zero();
      aside.segment<3>(3 * (j / 3)) = step * base.col(j % 3);
      compare(at(q, wrench - aside), at(q, wrench + aside), step, middle.by_load.col(j));
    }
    for (int i = 0; i < n; ++i) {
      const Eigen::VectorXd aside = 1e-4 * Eigen::VectorXd::Unit(2 * n, n + i);
      Eigen::VectorXd expected(7);
      expected << middle.by_rotation.col(i), middle.turn_by_rotation.col(i);
      compare(at(q - aside, wrench), at(q + aside, wrench), 1e-4, expected);
    }
  }
  EXPECT_GT(compared, 300);
}

TEST(CompliantLoad, AWarmStartIsAtTheEquilibriumOfAColdOne) {
  int compared = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 100; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = anyTubes(random);
    const Eigen::VectorXd q = jointsAnywhere(arm, random, 0.0);
    const Wrench wrench = 0.3 * anyWrench(arm, q, random);
    const CompliantModel model(arm);
    Branch branch;
    LoadedTip tip;
    ASSERT_EQ(model.loadedTip(q, wrench, branch, tip), ModelStatus::kOk);
    const LoadedTip first = tip;
    ASSERT_EQ(model.loadedTip(q, wrench, branch, tip), ModelStatus::kOk);
    EXPECT_LT((tip.pose.matrix() - first.pose.matrix()).norm(), 1e-12);
    EXPECT_LT((tip.compliance - first.compliance).norm(), 1e-6 * first.compliance.norm());
    Eigen::VectorXd there = q;
    there.tail(arm.tubeCount()) += std::pow(10.0, random.uniform(-5.0, -1.0)) * anyVector(random, 1.0).head(1)[0] *
                                   Eigen::VectorXd::Unit(arm.tubeCount(), 0);
    ASSERT_EQ(model.loadedTip(there, wrench, branch, tip), ModelStatus::kOk);
    Branch cold;
    LoadedTip expected;
    ASSERT_EQ(model.loadedTip(there, wrench, cold, expected), ModelStatus::kOk);
    if (branch.snapped || (branch.end_angle - cold.end_angle).norm() > 1e-3)
      continue;  // another equilibrium
    EXPECT_LT((tip.pose.matrix() - expected.pose.matrix()).norm(), 1e-9);
    EXPECT_LT((tip.jacobian - expected.jacobian).norm(), 1e-5 * expected.jacobian.norm());
    ++compared;
  }
  EXPECT_GT(compared, 80);
}

TEST(CompliantLoad, AllocatesNothingAndRefusesWhatIsNoNumber) {
  const CompliantModel model(timcArm());
  Random random(baseSeed());
  Branch branch;
  LoadedTip tip;
  std::vector<std::pair<Eigen::VectorXd, Wrench>> cases;
  for (int k = 0; k < 50; ++k) {
    const Eigen::VectorXd q = jointsAnywhere(model.arm(), random, 0.2);
    cases.emplace_back(q, anyWrench(model.arm(), q, random));
  }
  const std::size_t before = allocationCount();
  for (const auto& [q, wrench] : cases) {
    ASSERT_EQ(model.loadedTip(q, wrench, branch, tip), ModelStatus::kOk);
    ASSERT_EQ(model.loadedTip(q, wrench, branch, tip), ModelStatus::kOk);
  }
  if (canCountAllocations()) {
    EXPECT_EQ(allocationCount(), before);
  }
  Wrench broken = Wrench::Zero();
  broken[1] = std::nan("");
  EXPECT_EQ(model.loadedTip(cases[0].first, broken, branch, tip), ModelStatus::kNotFinite);
}

}  // namespace
}  // namespace tandem::test
