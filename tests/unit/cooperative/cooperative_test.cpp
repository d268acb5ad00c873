// SPDX-License-Identifier: Apache-2.0
/** @file Held objects and assisted arms under the controller, from their robot files. */
#include <gtest/gtest.h>

#include <cmath>

#include "experiments/catheters.h"
#include "experiments/track.h"

namespace tandem::experiments::test {
namespace {

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
  return {shape, std::move(directions), 5e-3, 10.0, mechanism.length(), Hold::kNone};
}

TEST(HeldObject, MobilityIsThatOfThePaper) {
  for (const auto& [type, mobility] :
       {std::pair{ContactType::kRigid, 1}, {ContactType::kSoftFinger, 4}, {ContactType::kPoint, 6}}) {
    config::CooperativeRobot robot = holding(type);
    robot.object->load.setZero();
    HeldObjectMechanism mechanism(robot);
    ASSERT_EQ(mechanism.settle(mechanism.home()), "");
    EXPECT_EQ(mechanism.state().mobility, mobility) << nameOf(type);
  }
}

TEST(HeldObject, RigidContactsMoveAlongTheirCommonAxisAloneAndSayWhatIsMissing) {
  config::CooperativeRobot robot = holding(ContactType::kRigid);
  robot.object->load.setZero();
  robot.object->squeeze = 0.0;
  HeldObjectMechanism mechanism(robot);
  ASSERT_EQ(mechanism.settle(mechanism.home()), "");
  const ObjectPath up = pathOf(PathShape::kLine, {2}, mechanism);
  const TrackRecord good = track(mechanism, up, optionsOf(robot));
  EXPECT_TRUE(good.good()) << good.refused << good.stopped;
  const TrackRecord bad = track(mechanism, pathOf(PathShape::kLissajous, {0, 2}, mechanism), optionsOf(robot));
  EXPECT_NE(bad.refused.find("the path asks for translation along x"), std::string::npos) << bad.refused;
  EXPECT_NE(bad.refused.find("missing: "), std::string::npos) << bad.refused;
  for (const TrackStep& step : bad.steps)
    EXPECT_LT(step.time, 0.0) << "moved along a path that was refused";
}

TEST(Assisted, FollowsACircleWithBothArmsAndHoldsThePush) {
  const config::CooperativeRobot robot = preset("ablation-assist");
  AssistedMechanism mechanism(robot);
  ASSERT_EQ(mechanism.settle(mechanism.home()), "");
  const double push = mechanism.chain().push;
  EXPECT_GT(push, 0.0);
  ObjectPath path = pathOf(PathShape::kCircle, {0, 1}, mechanism);
  path.held = Hold::kPlaces;
  const TrackRecord record = track(mechanism, path, optionsOf(robot));
  EXPECT_TRUE(record.good()) << record.refused << record.stopped;
  EXPECT_LT(record.max_drift, 1e-8);
  EXPECT_NEAR(mechanism.chain().push, push, 0.2 * push);
}

TEST(Assisted, SaysWhyThereIsNoRest) {
  const config::CooperativeRobot robot = preset("ablation-assist");
  AssistedMechanism mechanism(robot);
  RobotVector q = mechanism.home();
  q[3] -= 2.0 * robot.assistance->press;  // drawn back
  EXPECT_EQ(mechanism.settle(q), kinematics::assist::describe(kinematics::assist::Status::kNoContact));
}

TEST(ObjectPath, RateIsTheDerivativeOfTheFrame) {
  for (const PathShape shape : {PathShape::kLine, PathShape::kCircle, PathShape::kLissajous}) {
    const ObjectPath path{shape, shape == PathShape::kLine ? std::vector{4} : std::vector{3, 5}, 0.01, 4.0, 0.02, Hold::kAll};
    for (double t = 0.1; t < 4.0; t += 0.37) {
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
}  // namespace tandem::experiments::test
