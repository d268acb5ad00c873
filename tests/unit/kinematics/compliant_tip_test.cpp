// SPDX-License-Identifier: Apache-2.0
#include "kinematics/rigid_model.h"
#include "tests/unit/kinematics/arms.h"
#include "tests/unit/kinematics/boundary_value_oracle.h"
#include "tests/unit/kinematics/energy_oracle.h"

namespace tandem::test {
namespace {

using kinematics::Branch;
using kinematics::CompliantModel;
using kinematics::ConcentricTubeArm;
using kinematics::ModelStatus;
using kinematics::ShapePoint;
using kinematics::Tip;

/// Counts how many of the comparisons involve torsion.
struct TipTally {
  int compared = 0;
  int twisted = 0;  ///< by more than 0.01 rad
  double worst = 0.0;
};

void compareWithOracle(const ConcentricTubeArm& arm, const Eigen::VectorXd& q, TipTally& tally) {
  const CompliantModel model(arm);
  Tip tip;
  Branch branch;
  ASSERT_EQ(model.tip(q, branch, tip), ModelStatus::kOk) << q.transpose();
  std::vector<ShapePoint> shape;
  Branch same = branch;
  ASSERT_EQ(model.shape(q, kinematics::Wrench::Zero(), same, 2, shape), ModelStatus::kOk);
  Eigen::VectorXd guess = Eigen::VectorXd::Zero(arm.tubeCount());
  for (int i = 0; i < arm.tubeCount(); ++i)
    guess[i] = std::isnan(shape.front().moment[i]) ? 0.0 : shape.front().moment[i];
  const auto expected = BoundaryValueOracle(arm).solve(q, guess);
  ASSERT_TRUE(expected.converged) << "residual " << expected.residual << " at " << q.transpose();
  const double error = (tip.pose.translation() - expected.tip.translation()).norm();
  EXPECT_LT(error, 1e-7) << q.transpose() << "\nstability " << tip.stability;
  EXPECT_LT(turned(tip.pose.linear(), expected.tip.linear()), 1e-6) << q.transpose();
  EXPECT_LT((branch.end_angle.head(arm.tubeCount()) - expected.end_angle).norm(), 1e-6) << q.transpose();
  ++tally.compared;
  tally.worst = std::max(tally.worst, error);
  tally.twisted += twist(branch, q) > 0.01 ? 1 : 0;
}

TEST(CompliantTip, AgreesWithShootingForRandomArms) {
  TipTally tally;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 400; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = anyTubes(random);
    compareWithOracle(arm, jointsAnywhere(arm, random), tally);
    if (HasFatalFailure())
      return;
  }
  RecordProperty("worst_m", std::to_string(tally.worst));
  EXPECT_GT(tally.twisted, tally.compared / 2);
}

TEST(CompliantTip, AgreesWithShootingForThePublishedArms) {
  for (const NamedArm& named : namedArms()) {
    SCOPED_TRACE(named.name);
    TipTally tally;
    for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 120; ++seed) {
      SCOPED_TRACE(trace(seed));
      Random random(seed);
      compareWithOracle(named.arm, jointsAnywhere(named.arm, random, 0.6), tally);
      if (HasFatalFailure())
        return;
    }
    EXPECT_GT(tally.twisted, tally.compared / 3);
  }
}

TEST(CompliantTip, BecomesTheRigidModelAsTubesStopTwisting) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 300; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    auto arm = anyTubes(random);
    const Eigen::VectorXd q = jointsAnywhere(arm, random);
    for (auto& tube : arm.tubes) {
      for (auto& section : tube.sections)
        section.torsional_stiffness *= 1e6;
    }
    Tip soft, rigid;
    ASSERT_EQ(CompliantModel(arm).tip(q, soft), ModelStatus::kOk);
    ASSERT_EQ(kinematics::RigidModel(arm).tip(q, rigid), ModelStatus::kOk);
    EXPECT_LT((soft.pose.translation() - rigid.pose.translation()).norm(), 1e-5);
    EXPECT_LT(turned(soft.pose.linear(), rigid.pose.linear()), 1e-4);
    EXPECT_LT((soft.jacobian - rigid.jacobian).cwiseAbs().maxCoeff(), 1e-3);
    EXPECT_NEAR(soft.stability, 1.0, 1e-3);
    EXPECT_EQ(soft.conjugate_points, 0);
  }
}

TEST(CompliantTip, TurnsWithAllMotorsAndMirrors) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 300; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    auto arm = anyTubes(random);
    arm.base.setIdentity();
    arm.tool.setIdentity();
    const int n = arm.tubeCount();
    const CompliantModel model(arm);
    const Eigen::VectorXd q = jointsAnywhere(arm, random);
    const double angle = random.uniform(-3.0, 3.0);
    Eigen::VectorXd all = q, mirrored = q;
    all.tail(n).array() += angle;
    mirrored.tail(n) *= -1.0;
    Tip tip, turned_tip, mirrored_tip;
    ASSERT_EQ(model.tip(q, tip), ModelStatus::kOk);
    ASSERT_EQ(model.tip(all, turned_tip), ModelStatus::kOk);
    for (auto& tube : arm.tubes) {
      for (auto& section : tube.sections)
        section.helix_torsion *= -1.0;
    }
    ASSERT_EQ(CompliantModel(arm).tip(mirrored, mirrored_tip), ModelStatus::kOk);
    const Eigen::Isometry3d turn(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()));
    EXPECT_LT(((turn * tip.pose).matrix() - turned_tip.pose.matrix()).norm(), 1e-8 / tip.stability) << q.transpose();
    const Eigen::Vector3d across(1.0, -1.0, 1.0);
    EXPECT_LT((across.cwiseProduct(tip.pose.translation()) - mirrored_tip.pose.translation()).norm(),
              1e-9 / tip.stability)
        << q.transpose();
  }
}

TEST(CompliantShape, EndsWithoutTorsionAndTwistsByItsMoments) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 100; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = anyTubes(random);
    const Eigen::VectorXd q = jointsAnywhere(arm, random);
    const int n = arm.tubeCount();
    Tip tip;
    std::vector<ShapePoint> shape;
    const CompliantModel model(arm);
    ASSERT_EQ(model.tip(q, tip), ModelStatus::kOk);
    ASSERT_EQ(model.shape(q, 501, shape), ModelStatus::kOk);
    EXPECT_LT(((shape.back().pose * arm.tool).matrix() - tip.pose.matrix()).norm(), 1e-8);
    EXPECT_NEAR(shape.back().moment[0], 0.0, 1e-15);
    double most = 0.0;  // greatest torque per length between tubes, N
    for (const auto& tube : arm.tubes) {
      for (const auto& section : tube.sections)
        most = std::max(most, std::abs(section.bending_stiffness * section.curvature));
    }
    for (std::size_t k = 0; k < shape.size(); ++k) {
      double sum = 0.0;
      for (int i = 0; i < n; ++i) {
        const double end = q[i] + arm.tubes[i].length();
        ASSERT_EQ(std::isnan(shape[k].psi[i]), std::isnan(shape[k].moment[i]));
        if (std::isnan(shape[k].psi[i])) {
          EXPECT_GT(shape[k].s, end - 1e-9);
          continue;
        }
        EXPECT_LT(shape[k].s, end + 1e-9);
        EXPECT_LE(shape[k].outermost_tube, n);
        // Only the neighbours' torque increases the moment from zero at the free end.
        EXPECT_LE(std::abs(shape[k].moment[i]), n * most * (end - shape[k].s) * 15.0 + 1e-12);
        sum += shape[k].moment[i];
      }
      EXPECT_NEAR(sum, 0.0, 1e-12);  // tubes twist only against each other
      const double chord = k == 0 ? 0.0 : (shape[k].pose.translation() - shape[k - 1].pose.translation()).norm();
      EXPECT_LE(chord, (k == 0 ? 0.0 : shape[k].s - shape[k - 1].s) * (1.0 + 1e-9));
    }
    EXPECT_TRUE(shape.front().pose.isApprox(
        arm.base * Eigen::AngleAxisd(shape.front().psi[0], Eigen::Vector3d::UnitZ()), 1e-8));
  }
}

/// A smooth variation of all angles.
Eigen::MatrixXd variation(const EnergyOracle& energy, int tubes, double length, Random& random) {
  Eigen::MatrixXd change = Eigen::MatrixXd::Zero(tubes, energy.nodes());
  for (int i = 0; i < tubes; ++i) {
    const double amplitude = random.uniform(-1.0, 1.0), phase = random.uniform(0.0, 6.3),
                 waves = random.uniform(0.0, 9);
    for (int k = 0; k < energy.nodes() && energy.reaches(i, k); ++k)
      change(i, k) = amplitude * std::sin(phase + waves * energy.place(k) / length);
  }
  return change;
}

TEST(CompliantShape, HasStationaryAndMinimalEnergy) {
  int twisted = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 100; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = anyTubes(random);
    Eigen::VectorXd q = jointsAnywhere(arm, random);
    for (int i = 0; i < arm.tubeCount(); ++i)
      q[i] = std::min(q[i], -1e-3);  // a motor at the entry point would fix the angle there
    const CompliantModel model(arm);
    std::vector<ShapePoint> shape;
    Branch branch;
    ASSERT_EQ(model.shape(q, kinematics::Wrench::Zero(), branch, 2001, shape), ModelStatus::kOk);
    twisted += twist(branch, q) > 0.01 ? 1 : 0;
    const EnergyOracle energy(arm, q, 2e-4);
    const auto psi = energy.interpolate(shape);
    const double value = energy.value(psi);
    for (int k = 0; k < 5; ++k) {
      const auto change = variation(energy, arm.tubeCount(), shape.back().s, random);
      const double h = 1e-3;
      const double up = energy.value(psi + h * change), down = energy.value(psi - h * change);
      const double second = (up - 2.0 * value + down) / (h * h);
      EXPECT_GT(second, 0.0);
      // The first variation is small compared with the change due to a milliradian.
      EXPECT_LT(std::abs(up - down) / (2.0 * h), 1e-4 * (second + std::abs(value))) << q.transpose();
    }
    EXPECT_EQ(energy.negativeDirections(psi), 0);
  }
  EXPECT_GT(twisted, 50);
}

TEST(CompliantTip, HasASolutionOrAReason) {
  const CompliantModel model(arkArm(0.0));
  Tip tip;
  Branch branch;
  Eigen::VectorXd q = arkStart(1, 0);
  EXPECT_EQ(model.tip(q.head(5), branch, tip), ModelStatus::kWrongSize);
  q[4] = std::nan("");
  EXPECT_EQ(model.tip(q, branch, tip), ModelStatus::kNotFinite);
  q = arkStart(1, 0);
  q[0] = -0.437;
  EXPECT_EQ(model.tip(q, branch, tip), ModelStatus::kNotExtended);
  q = arkStart(1, 0);
  q[2] = 0.01;
  EXPECT_EQ(model.tip(q, branch, tip), ModelStatus::kProtruded);
  q << -0.3, -0.1, -0.05, 0, 0, 0;
  EXPECT_EQ(model.tip(q, branch, tip), ModelStatus::kInnerInside);
  EXPECT_FALSE(branch.known) << "a refusal leaves the branch alone";
  EXPECT_TRUE(tip.pose.isApprox(Eigen::Isometry3d::Identity()));
}

}  // namespace
}  // namespace tandem::test
