// SPDX-License-Identifier: Apache-2.0
/** @file Rigid grips under load: the internal forces that joints change are controlled, the others are reported. */
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <cmath>
#include <map>

#include "kinematics/rotations.h"
#include "robots/catheters.h"
#include "robots/track.h"
#include "tests/unit/support/random_tubes.h"

namespace tandem::robots::test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using tandem::test::Random;
namespace grasp = kinematics::grasp;

constexpr double kLargestLoad = 0.03;  // N

config::CooperativeRobot gripping(const Vector3d& load) {
  config::CooperativeRobot robot =
      config::loadCooperative(std::string(TANDEM_PRESETS) + "/cooperative/ablation-pair.yaml");
  robot.object->load = load;
  return robot;
}

/// Load with a magnitude from a micronewton to kLargestLoad.
Vector3d anyLoad(Random& random) {
  return tandem::test::anyVector(random, 1.0).normalized() *
         std::pow(10.0, random.uniform(-6.0, std::log10(kLargestLoad)));
}

TrackOptions gripOptions(const config::CooperativeRobot& robot) {
  TrackOptions options;
  options.parameters = robot.parameters;
  return options;
}

/// Runs 3 mm to and fro along z under a load. @return record
TrackRecord lift(const Vector3d& load, double duration) {
  const config::CooperativeRobot robot = gripping(load);
  GraspedObjectMechanism mechanism(robot);
  const ObjectPath up{PathShape::kLine, {2}, 3e-3, duration, mechanism.length(), Kept::kNone};
  return track(mechanism, up, gripOptions(robot));
}

TEST(Grip, MovesALoadAlongItsAxis) {
  std::vector<Vector3d> loads;
  for (const double weight : {1e-6, 1e-3, kLargestLoad})
    loads.emplace_back(0.0, 0.0, -weight);
  for (std::uint32_t seed = tandem::test::baseSeed(); seed < tandem::test::baseSeed() + tandem::test::cases(5);
       ++seed) {
    Random random(seed);
    loads.push_back(anyLoad(random));
    std::printf("seed %u: load %.3g %.3g %.3g N\n", seed, loads.back().x(), loads.back().y(), loads.back().z());
  }
  for (const Vector3d& load : loads) {
    SCOPED_TRACE(testing::Message() << "load " << load.transpose() << " N");
    const TrackRecord record = lift(load, 2.0);
    ASSERT_TRUE(record.good()) << record.refused << record.stopped;
    EXPECT_LT(record.max_error, 2e-5);
    EXPECT_LT(record.max_residual, 1e-4);
    EXPECT_GT(record.steps.back().time, 1.99);
  }
}

std::map<std::string, double> columnsOf(const Mechanism& mechanism) {
  std::map<std::string, double> columns;
  for (const auto& [name, value] : mechanism.columns())
    columns[name] = value;
  return columns;
}

/** Statics of two rigid contacts at given poses, from their definition: contact components are force and moment in the
 * contact frame, moments count per length of the object. */
struct Statics {
  Statics(const GraspedObjectMechanism& mechanism, const config::GraspedObject& object) {
    const Eigen::Isometry3d& pose = mechanism.pose();
    scale = VectorXd::Ones(12);
    for (Index k = 0; k < 2; ++k) {
      frames.push_back(pose * object.contacts[static_cast<std::size_t>(k)].frame);
      const Eigen::Matrix3d turn = frames.back().linear();
      const Vector3d lever = frames.back().translation() - pose.translation();
      for (int i = 0; i < 3; ++i) {
        wrench.col(6 * k + i) << turn.col(i), lever.cross(turn.col(i));
        wrench.col(6 * k + 3 + i) << Vector3d::Zero(), turn.col(i);
      }
      scale.segment<3>(6 * k + 3).setConstant(object.size);
    }
    const Eigen::JacobiSVD<MatrixXd> svd(wrench * scale.asDiagonal(), Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix<double, 6, 1> load;
    load << object.load, Vector3d::Zero();
    wanted = scale.asDiagonal() * svd.solve(-load);
    internal = svd.matrixV().rightCols(6);
  }

  std::vector<Eigen::Isometry3d> frames;  ///< of the contacts, robot base frame
  Eigen::Matrix<double, 6, 12> wrench;    ///< on the object, by contact components
  VectorXd scale;
  VectorXd wanted;    ///< the least forces that carry the load
  MatrixXd internal;  ///< orthonormal basis of the scaled components without a wrench
};

/// Relative displacement, in the scaled components that make no wrench, of free arms under the desired forces instead
/// of the present ones.
VectorXd displacement(const GraspedObjectMechanism& mechanism,
                      const config::GraspedObject& object,
                      const Statics& statics) {
  VectorXd moved(12);
  for (Index k = 0; k < 2; ++k) {
    const auto arm = static_cast<std::size_t>(k);
    const Eigen::Isometry3d& frame = statics.frames[arm];
    kinematics::LoadedTip tip = mechanism.equilibrium().tips[arm];
    const Vector3d force = frame.linear() * statics.wanted.segment<3>(6 * k);
    const Vector3d moment = frame.linear() * statics.wanted.segment<3>(6 * k + 3);
    kinematics::Wrench on_tip;
    on_tip << -force, -moment - (frame.translation() - tip.pose.translation()).cross(force);
    auto branch = mechanism.equilibrium().branches[arm];
    EXPECT_EQ(mechanism.model().arms()[arm].tip(mechanism.joints().segment<3>(3 * k), on_tip, branch, tip),
              kinematics::ModelStatus::kOk);
    const Eigen::Isometry3d there = tip.pose * object.contacts[arm].hand;
    moved.segment<3>(6 * k) = frame.linear().transpose() * (there.translation() - frame.translation());
    moved.segment<3>(6 * k + 3) =
        frame.linear().transpose() * kinematics::logarithm(there.linear() * frame.linear().transpose());
  }
  return statics.internal.transpose() * statics.scale.asDiagonal() * moved;
}

TEST(Grip, StatesTheInternalForcesThatStay) {
  for (std::uint32_t seed = tandem::test::baseSeed(); seed < tandem::test::baseSeed() + tandem::test::cases(8);
       ++seed) {
    SCOPED_TRACE(tandem::test::trace(seed));
    Random random(seed);
    const config::CooperativeRobot robot = gripping(anyLoad(random));
    const config::GraspedObject& object = *robot.object;
    GraspedObjectMechanism mechanism(robot);
    RobotVector q;
    ASSERT_EQ(prepare(mechanism, gripOptions(robot), q), "");
    const Statics statics(mechanism, object);
    const VectorXd& force = mechanism.equilibrium().force;
    const double size = object.load.norm();
    EXPECT_LT(((statics.wrench * force).head<3>() + object.load).norm(), 1e-9);
    const VectorXd error = force - statics.wanted;
    std::map<std::string, double> columns = columnsOf(mechanism);
    const double largest = std::max(error.segment<3>(0).norm(), error.segment<3>(6).norm());
    EXPECT_NEAR(columns["internal_error_N"], largest, 1e-9 + 1e-9 * size);
    EXPECT_NEAR(columns["internal_error_Nm"], std::max(error.segment<3>(3).norm(), error.segment<3>(9).norm()),
                1e-11 + 1e-9 * size);
    EXPECT_GT(columns["internal_error_N"], 1e-3 * size);
    // The distance is to first order in the error of the forces.
    const double found = displacement(mechanism, object, statics).norm();
    EXPECT_NEAR(std::hypot(columns["uncontrolled_m"], mechanism.residual()), found, 0.1 * found + 1e-9);
    EXPECT_LT(mechanism.residual(), 2.1e-6);
  }
}

/// Two arms with parallel axes change five of six internal forces at any joints: together they only lift the object.
TEST(Grip, ControlsWhatTheUnloadedArmsCanChange) {
  for (std::uint32_t seed = tandem::test::baseSeed(); seed < tandem::test::baseSeed() + tandem::test::cases(8);
       ++seed) {
    SCOPED_TRACE(tandem::test::trace(seed));
    Random random(seed);
    const config::CooperativeRobot robot = gripping(anyLoad(random));
    GraspedObjectMechanism mechanism(robot);
    RobotVector q = mechanism.home();
    for (Index j = 0; j < q.size(); ++j)
      q[j] += (j % 3 == 0 ? 1e-3 : 0.01) * random.uniform(-1.0, 1.0);
    ASSERT_EQ(mechanism.solveEquilibrium(q), "");
    Index rows = 0;
    for (const control::Task& task : mechanism.higherTasks(1.0))
      rows += task.jacobian.rows();
    EXPECT_EQ(rows, 5);
  }
}

/// Without load the tasks are Z^T C df/dq = Z^T B J, in as many combinations as the rank of Z^T B J.
TEST(Grip, TasksWithoutLoadAreTheContactConsistency) {
  for (const auto& [type, count] :
       {std::pair{grasp::ContactType::kRigid, 5}, std::pair{grasp::ContactType::kSoftFinger, 2},
        std::pair{grasp::ContactType::kPoint, 1}}) {
    config::CooperativeRobot robot = gripping(Vector3d::Zero());
    for (auto& contact : robot.object->contacts)
      contact.type = type;
    GraspedObjectMechanism mechanism(robot);
    for (const double insertion : {0.0, 2e-3, -3e-3}) {
      RobotVector q = mechanism.home();
      q[0] += insertion, q[3] += insertion;
      ASSERT_EQ(mechanism.solveEquilibrium(q), "");
      const grasp::GraspEquilibrium& at = mechanism.equilibrium();
      const MatrixXd rates = at.state.internal_forces.transpose() * (at.compliance * at.force_by_joints);
      const MatrixXd consistency = at.state.consistency;
      EXPECT_LT((rates - consistency).norm(), 1e-8 * consistency.norm());
      const MatrixXd choice = Eigen::JacobiSVD<MatrixXd>(rates, Eigen::ComputeThinU).matrixU().leftCols(count);
      const MatrixXd expected = choice.transpose() * rates;
      MatrixXd found(0, q.size());
      for (const control::Task& task : mechanism.higherTasks(1.0)) {
        found.conservativeResize(found.rows() + task.jacobian.rows(), Eigen::NoChange);
        found.bottomRows(task.jacobian.rows()) = task.jacobian;
        EXPECT_LT(task.velocity.norm(), 1e-9);
      }
      ASSERT_EQ(found.rows(), expected.rows()) << nameOf(type);
      EXPECT_LT((found - expected).norm(), 1e-12) << nameOf(type);
    }
  }
}

}  // namespace
}  // namespace tandem::robots::test
