// SPDX-License-Identifier: Apache-2.0
/** @file Closed-loop control of grasped objects and target-assist pairs, from robot files. */
#include <gtest/gtest.h>

#include <cmath>

#include "experiments/payload.h"
#include "robots/catheters.h"
#include "robots/track.h"
#include "tests/unit/kinematics/differences.h"

namespace tandem::robots::test {
namespace {

using experiments::Payload;
using experiments::PayloadOptions;
using experiments::PayloadStudy;
using kinematics::grasp::ContactType;

config::CooperativeRobot preset(const std::string& name) {
  return config::loadCooperative(std::string(TANDEM_PRESETS) + "/cooperative/" + name + ".yaml");
}

config::CooperativeRobot holding(ContactType type) {
  config::CooperativeRobot robot = preset("ablation-pair");
  for (auto& contact : robot.object->contacts)
    contact.type = type;
  return robot;
}

TrackOptions optionsOf(const config::CooperativeRobot& robot, control::Method method = control::Method::kNspqp) {
  TrackOptions options;
  options.method = method;
  options.parameters = robot.parameters;
  return options;
}

ObjectPath pathOf(PathShape shape, std::vector<int> directions, const Mechanism& mechanism) {
  return {shape, std::move(directions), 5e-3, 10.0, mechanism.length(), Kept::kNone};
}

TEST(GraspedObject, MobilityIsThatOfThePaper) {
  for (const auto& [type, mobility] :
       {std::pair{ContactType::kRigid, 1}, {ContactType::kSoftFinger, 4}, {ContactType::kPoint, 6}}) {
    config::CooperativeRobot robot = holding(type);
    robot.object->load.setZero();
    GraspedObjectMechanism mechanism(robot);
    ASSERT_EQ(mechanism.solveEquilibrium(mechanism.home()), "");
    EXPECT_EQ(mechanism.state().mobility, mobility) << nameOf(type);
  }
}

TEST(GraspedObject, RigidContactsMoveAlongTheirCommonAxisOnlyAndNameTheMissingDirections) {
  config::CooperativeRobot robot = holding(ContactType::kRigid);
  robot.object->load.setZero();
  robot.object->squeeze = 0.0;
  GraspedObjectMechanism mechanism(robot);
  ASSERT_EQ(mechanism.solveEquilibrium(mechanism.home()), "");
  const ObjectPath up = pathOf(PathShape::kLine, {2}, mechanism);
  const TrackRecord good = track(mechanism, up, optionsOf(robot));
  EXPECT_TRUE(good.good()) << good.refused << good.stopped;
  const TrackRecord bad = track(mechanism, pathOf(PathShape::kLissajous, {0, 2}, mechanism), optionsOf(robot));
  EXPECT_NE(bad.refused.find("the path requires translation along x"), std::string::npos) << bad.refused;
  EXPECT_NE(bad.refused.find("not possible: "), std::string::npos) << bad.refused;
  for (const TrackStep& step : bad.steps)
    EXPECT_LT(step.time, 0.0) << "moved along a path that was refused";
}

/// A pair that squeezes its grasped object and carries its weight.
config::CooperativeRobot pressing(ContactType type) {
  config::CooperativeRobot robot = holding(type);
  robot.object->squeeze = 0.002;
  robot.object->load = {0.0001, -0.0001, -0.0003};
  return robot;
}

/// Joints with squeeze; rigid contacts need a bend, since joints cannot squeeze the object evenly.
RobotVector pressed(GraspedObjectMechanism& mechanism, const config::CooperativeRobot& robot) {
  RobotVector q = mechanism.home();
  if (robot.object->contacts[0].type == ContactType::kRigid) {
    q[2] += 0.03;
    EXPECT_EQ(mechanism.solveEquilibrium(q), "");
  } else {
    EXPECT_EQ(prepare(mechanism, optionsOf(robot), q), "");
  }
  return q;
}

TEST(GraspedObject, SagUnderALoadMatchesTheStiffness) {
  for (const ContactType type : {ContactType::kRigid, ContactType::kSoftFinger, ContactType::kPoint}) {
    config::CooperativeRobot robot = pressing(type);
    GraspedObjectMechanism mechanism(robot);
    const RobotVector q = pressed(mechanism, robot);
    const auto equilibrium = mechanism.equilibrium();
    const Eigen::Vector3d load = robot.object->load;
    for (int k = 0; k < 3; ++k) {
      const tandem::test::Difference sag = tandem::test::differentiate(
          [&](double h) -> Eigen::VectorXd {
            auto there = equilibrium;
            kinematics::Wrench wrench = kinematics::Wrench::Zero();
            wrench.head<3>() = load + h * Eigen::Vector3d::Unit(k);
            EXPECT_EQ(mechanism.model().solveEquilibrium(q, wrench, there), kinematics::grasp::GraspStatus::kOk);
            return difference(equilibrium.pose, there.pose);
          },
          3e-4);
      EXPECT_LT((sag.value - equilibrium.displacement_by_load.col(k)).head<3>().norm(),
                1e-5 * sag.value.head<3>().norm());
    }
  }
}

/// The object rests: what it passes on to the arms is its load, in force and in moment about its origin.
TEST(GraspedObject, WrenchesOnTheTipsCarryTheLoad) {
  for (const ContactType type : {ContactType::kRigid, ContactType::kSoftFinger, ContactType::kPoint}) {
    SCOPED_TRACE(nameOf(type));
    const config::CooperativeRobot robot = pressing(type);
    GraspedObjectMechanism mechanism(robot);
    EXPECT_EQ(mechanism.solveEquilibrium(pressed(mechanism, robot)), "");
    const auto wrenches = mechanism.tipWrenches();
    const auto tips = mechanism.tips();
    ASSERT_EQ(wrenches.size(), tips.size());
    Eigen::Vector3d force = -robot.object->load, moment = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < tips.size(); ++k) {
      ASSERT_TRUE(wrenches[k]);
      const Eigen::Vector3d on_tip = wrenches[k]->head<3>();
      const Eigen::Vector3d lever = tips[k].translation() - mechanism.pose().translation();
      EXPECT_GT(on_tip.norm(), 0.1 * robot.object->load.norm());
      force += on_tip;
      moment += wrenches[k]->tail<3>() + lever.cross(on_tip);
    }
    EXPECT_LT(force.norm(), 1e-6 * robot.object->load.norm());
    EXPECT_LT(moment.norm(), 1e-6 * robot.object->load.norm() * mechanism.length());
  }
}

TEST(GraspedObject, JacobianUnderALoadMatchesTheEquilibria) {
  for (const ContactType type : {ContactType::kRigid, ContactType::kSoftFinger, ContactType::kPoint}) {
    const config::CooperativeRobot robot = pressing(type);
    GraspedObjectMechanism mechanism(robot);
    const RobotVector q = pressed(mechanism, robot);
    const auto equilibrium = mechanism.equilibrium();
    EXPECT_GT(equilibrium.force.norm(), robot.object->squeeze);
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const tandem::test::Difference slope = tandem::test::differentiate(
          [&](double h) -> Eigen::VectorXd {
            auto there = equilibrium;
            kinematics::Wrench wrench = kinematics::Wrench::Zero();
            wrench.head<3>() = robot.object->load;
            EXPECT_EQ(mechanism.model().solveEquilibrium(q + h * RobotVector::Unit(q.size(), j), wrench, there),
                      kinematics::grasp::GraspStatus::kOk);
            return difference(equilibrium.pose, there.pose);
          },
          j % 3 == 0 ? 5e-4 : 0.005);
      // In terms of contacts: rotations about the line between two point contacts are free.
      const Eigen::VectorXd wrong = equilibrium.state.by_object * (slope.value - equilibrium.jacobian.col(j));
      EXPECT_LT(wrong.norm(), 1e-5 * (equilibrium.state.by_object * slope.value).norm()) << nameOf(type);
    }
  }
}

/// Motion of the squeezed and loaded object along a Lissajous figure in its movable directions, by several methods.
TEST(GraspedObject, FollowsALissajousWithoutDriftOrSlip) {
  for (const ContactType type : {ContactType::kPoint, ContactType::kSoftFinger}) {
    for (const control::Method method : {control::Method::kNspqp, control::Method::kSnsqp, control::Method::kHqp}) {
      const config::CooperativeRobot robot = pressing(type);
      GraspedObjectMechanism mechanism(robot);
      const ObjectPath path{PathShape::kLissajous, {1, 2}, 2e-3, 6.0, mechanism.length(), Kept::kPosition};
      const TrackRecord record = track(mechanism, path, optionsOf(robot, method));
      SCOPED_TRACE(std::string(nameOf(type)) + ", " + std::string(control::name(method)));
      EXPECT_TRUE(record.good()) << record.refused << record.stopped;
      EXPECT_LT(record.max_residual, 1e-4);
      EXPECT_LT(record.max_error, 1e-3);
      for (const TrackStep& step : record.steps) {
        if (step.time < 0.0)
          continue;
        for (std::size_t k = 0; k < record.names.size(); ++k) {
          if (record.names[k].starts_with("normal")) {
            EXPECT_NEAR(step.columns[k], robot.object->squeeze, 0.3 * robot.object->squeeze);
          }
          if (record.names[k].starts_with("friction")) {
            EXPECT_LT(step.columns[k], 1.0);
          }
        }
      }
    }
  }
}

TEST(GraspedObject, InsufficientSqueezeIsRefusedBeforeMotion) {
  config::CooperativeRobot robot = pressing(ContactType::kPoint);
  const auto refusal_at = [&](double squeeze) {
    robot.object->squeeze = squeeze;
    GraspedObjectMechanism mechanism(robot);
    EXPECT_EQ(mechanism.solveEquilibrium(mechanism.home()), "");
    return mechanism.infeasibility();
  };
  const std::string refused = refusal_at(1e-5);
  ASSERT_NE(refused.find("expected more than "), std::string::npos) << refused;
  const double least = std::stod(refused.substr(refused.rfind("than ") + 5));
  // The least squeeze is exact: slightly below it is refused, slightly above it is not.
  EXPECT_NE(refusal_at(0.98 * least), "");
  EXPECT_EQ(refusal_at(1.02 * least), "");
  robot.object->squeeze = 1e-5;
  GraspedObjectMechanism mechanism(robot);
  const TrackRecord record = track(mechanism, pathOf(PathShape::kLissajous, {1, 2}, mechanism), optionsOf(robot));
  EXPECT_EQ(record.refused, refused);
  EXPECT_TRUE(record.steps.empty());
  robot.object->load.setZero();
  EXPECT_NE(refusal_at(0.0).find("rely on friction"), std::string::npos);
}

/// Two soft arms that squeeze a short object too hard tilt it, like a buckling column.
TEST(GraspedObject, UnstableSqueezeIsRefusedBeforeThePath) {
  config::CooperativeRobot robot = pressing(ContactType::kPoint);
  robot.object->squeeze = 0.03;
  GraspedObjectMechanism mechanism(robot);
  const TrackRecord record = track(mechanism, pathOf(PathShape::kLissajous, {1, 2}, mechanism), optionsOf(robot));
  EXPECT_NE(record.refused, "");
  for (const TrackStep& step : record.steps)
    EXPECT_LT(step.time, 0.0);
}

/// At 0.169 N in the middle one of these directions arm_a alone would buckle; the grasp does not.
TEST(Payload, ChangesLittleBetweenNeighbouringDirections) {
  const config::CooperativeRobot robot = preset("ablation-pair");
  GraspedObjectMechanism mechanism(robot);
  RobotVector q;
  ASSERT_EQ(prepare(mechanism, optionsOf(robot), q), "");
  const PayloadStudy study(robot, mechanism);
  for (const double middle : {3.9924406639370282, 0.3}) {
    double before = 0.0;
    for (const double turned : {-0.016, 0.0, 0.016}) {
      const Eigen::Vector3d direction(std::sin(middle + turned), 0.0, std::cos(middle + turned));
      const Payload carried = study.carried(0, direction, {});
      EXPECT_EQ(carried.limit, "the displacement of the object exceeds the allowed value") << middle + turned;
      if (before > 0.0) {
        EXPECT_NEAR(carried.load / before, 1.0, 0.05) << middle + turned;
      }
      before = carried.load;
    }
  }
}

TEST(Payload, MatchesEquilibriaAndFriction) {
  config::CooperativeRobot robot = holding(ContactType::kPoint);
  robot.object->squeeze = 0.002;
  GraspedObjectMechanism mechanism(robot);
  RobotVector q;
  ASSERT_EQ(prepare(mechanism, optionsOf(robot), q), "");
  const PayloadStudy study(robot, mechanism);
  ASSERT_EQ(study.carriers(), (std::vector<std::string>{"all", "arm_a", "arm_b"}));
  EXPECT_NE(study.refusal(1), "");  // a single point contact cannot hold it
  const Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();
  const Payload carried = study.carried(0, down, {0.02, 10.0});
  EXPECT_NE(carried.limit, "");
  // That load is carried, and a slightly larger one is not.
  for (const double part : {0.99, 1.01}) {
    kinematics::grasp::GraspEquilibrium equilibrium = mechanism.equilibrium();
    std::string error;
    for (int k = 1; k <= 50 && error.empty(); ++k) {
      kinematics::Wrench load = kinematics::Wrench::Zero();
      load.head<3>() = part * k / 50.0 * carried.load * down;
      error = mechanism.model().solveEquilibrium(q, load, equilibrium) == kinematics::grasp::GraspStatus::kOk
                  ? mechanism.errorOf(equilibrium)
                  : "no equilibrium";
      if ((equilibrium.pose.translation() - mechanism.pose().translation()).norm() > 0.02)
        error = "sag";
    }
    EXPECT_EQ(error.empty(), part < 1.0) << error;
  }
  EXPECT_NEAR(study.carried(0, down, {0.0002, 10.0}).sag, 0.0002, 2e-6);

  // Rigid contacts: two arms are stiffer than each of them, and the deflection under a load is its compliance.
  config::CooperativeRobot gripping = holding(ContactType::kRigid);
  GraspedObjectMechanism grip(gripping);
  ASSERT_EQ(prepare(grip, optionsOf(gripping), q), "");
  const PayloadStudy grips(gripping, grip);
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d along = Eigen::Vector3d::Unit(k);
    const double all = grips.carried(0, along, {}).stiffness;
    for (std::size_t arm = 1; arm <= 2; ++arm) {
      EXPECT_EQ(grips.refusal(arm), "");
      EXPECT_GT(all, grips.carried(arm, along, {}).stiffness);
    }
  }
}

TEST(Assisted, FollowsACircleWithBothArmsAndHoldsThePush) {
  const config::CooperativeRobot robot = preset("ablation-assist");
  AssistedMechanism mechanism(robot);
  ASSERT_EQ(mechanism.solveEquilibrium(mechanism.home()), "");
  const double push = mechanism.chain().push;
  EXPECT_GT(push, 0.0);
  const auto wrenches = mechanism.tipWrenches();
  ASSERT_EQ(wrenches.size(), 2u);
  EXPECT_FALSE(wrenches[0]) << "the target is pushed at its base of bending";
  ASSERT_TRUE(wrenches[1]);
  const Eigen::Vector3d normal = mechanism.chain().contact.linear().col(2);
  EXPECT_NEAR(std::abs(normal.dot(wrenches[1]->head<3>())), push, 1e-12);
  EXPECT_LT(wrenches[1]->head<3>().dot(mechanism.chain().wrench.head<3>()), 0.0) << "the counterforce";
  ObjectPath path = pathOf(PathShape::kCircle, {0, 1}, mechanism);
  path.kept = Kept::kPosition;
  const TrackRecord record = track(mechanism, path, optionsOf(robot));
  EXPECT_TRUE(record.good()) << record.refused << record.stopped;
  EXPECT_LT(record.max_residual, 1e-8);
  EXPECT_NEAR(mechanism.chain().push, push, 0.2 * push);
}

TEST(Assisted, NamesWhyThereIsNoEquilibrium) {
  const config::CooperativeRobot robot = preset("ablation-assist");
  AssistedMechanism mechanism(robot);
  RobotVector q = mechanism.home();
  q[3] -= 2.0 * robot.assistance->press;  // drawn back
  EXPECT_EQ(mechanism.solveEquilibrium(q), kinematics::assist::describe(kinematics::assist::Status::kNoContact));
}

TEST(ObjectPath, RateIsTheDerivativeOfThePose) {
  for (const PathShape shape : {PathShape::kLine, PathShape::kCircle, PathShape::kLissajous}) {
    const ObjectPath path{shape,     shape == PathShape::kLine ? std::vector{4} : std::vector{3, 5}, 0.01, 4.0, 0.02,
                          Kept::kAll};
    for (int i = 0; i < 11; ++i) {
      const double t = 0.1 + 0.37 * i;
      const double h = 1e-5;
      Twist at, rate, before, after, ignored;
      path.at(t, at, rate);
      path.at(t - h, before, ignored);
      path.at(t + h, after, ignored);
      const Eigen::Isometry3d start = displaced(Eigen::Isometry3d::Identity(), Twist::Constant(0.3));
      const Twist slope = difference(displaced(start, before), displaced(start, after)) / (2.0 * h);
      EXPECT_LT((slope - rate).norm(), 1e-7);
    }
  }
}

}  // namespace
}  // namespace tandem::robots::test
