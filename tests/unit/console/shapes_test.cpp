// SPDX-License-Identifier: Apache-2.0
/** @file Bodies of arms at given joints, as the page's preview asks for them. */
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "config/robot_files.h"
#include "planning/joint_sampler.h"
#include "services/console/shapes.h"

namespace tandem::console {
namespace {

const config::Robot& robot() {
  static const config::Robot robot = config::loadAnyRobot(config::findFile("ark2024", "robot"));
  return robot;
}

std::string textOf(const Eigen::VectorXd& q) {
  std::string text;
  for (double value : q)
    text += (text.empty() ? "" : ",") + std::to_string(value);
  return text;
}

/// Without a tool, a body ends at the tip of its arm's model.
TEST(Shapes, EndAtTheTips) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const robots::RobotModel model(robot());
  const Shapes shapes(robot(), "rigid");
  for (int round = 0; round < 50; ++round) {
    std::vector<Eigen::VectorXd> joints;
    for (const config::Arm& arm : robot().arms)
      joints.push_back(planning::JointSampler(arm.limits)
                           .inside(arm.home + 1e-3 * Eigen::VectorXd::NullaryExpr(arm.home.size(), [&](auto) {
                                                return std::uniform_real_distribution<double>(-20, 20)(random);
                                              })));
    const auto json = nlohmann::json::parse(shapes.at(textOf(model.stack(joints))));
    ASSERT_EQ(json["arms"].size(), 2u);
    for (std::size_t k = 0; k < 2; ++k) {
      const auto points = json["arms"][k]["points"].get<std::vector<double>>();
      const std::size_t count = json["arms"][k]["tubes"].size();
      ASSERT_EQ(points.size(), 3 * count);
      EXPECT_EQ(json["arms"][k]["outer_radius"].size(), count);
      kinematics::Tip tip;
      ASSERT_EQ(model.models()[k]->tip(joints[k], tip), kinematics::ModelStatus::kOk);
      EXPECT_LT((Eigen::Vector3d::Map(points.data() + points.size() - 3) - tip.pose.translation()).norm(), 1e-5);
    }
  }
}

/// Of any joint: its ends and its middle are where the arm's model has the tip.
TEST(Shapes, SpanTheTipsOfOneJoint) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const robots::RobotModel model(robot());
  const Shapes shapes(robot(), "rigid");
  for (int joint = 0; joint < model.jointCount(); ++joint) {
    const std::size_t arm = joint < model.offset(1) ? 0 : 1;
    const double lower = -0.1 * std::uniform_real_distribution<double>(0.5, 1)(random), upper = lower + 0.02;
    std::vector<Eigen::VectorXd> joints = {robot().arms[0].home, robot().arms[1].home};
    const auto json = nlohmann::json::parse(shapes.span(
        {textOf(model.stack(joints)), std::to_string(joint), std::to_string(lower), std::to_string(upper)}));
    ASSERT_EQ(json["tips"].size(), static_cast<std::size_t>(Shapes::kSpanPoints));
    for (const int k : {0, Shapes::kSpanPoints / 2, Shapes::kSpanPoints - 1}) {
      joints[arm][joint - model.offset(static_cast<int>(arm))] =
          lower + (upper - lower) * k / (Shapes::kSpanPoints - 1);
      kinematics::Tip tip;
      ASSERT_EQ(model.models()[arm]->tip(joints[arm], tip), kinematics::ModelStatus::kOk);
      const auto at = json["tips"][static_cast<std::size_t>(k)].get<std::vector<double>>();
      EXPECT_LT((Eigen::Vector3d::Map(at.data()) - tip.pose.translation()).norm(), 1e-5) << "joint " << joint;
    }
  }
}

TEST(Shapes, RefuseAWrongSpanWithTheReason) {
  const Shapes shapes(robot(), "rigid");
  const std::string home = textOf(Eigen::VectorXd::Constant(12, -0.1));
  for (const auto& [span, reason] : std::vector<std::pair<Shapes::Span, std::string>>{
           {{home, "12", "0", "1"}, "joint: found 12, expected a whole number from 0 to 11"},
           {{home, "-1", "0", "1"}, "joint: found -1, expected a whole number from 0 to 11"},
           {{home, "0.5", "0", "1"}, "joint: found 0.5, expected a whole number from 0 to 11"},
           {{home, "", "0", "1"}, "joint: found '', expected a finite number, m or rad"},
           {{home, "0", "1", "0"}, "lower: found 1, expected at most upper, 0"},
           {{home, "0", "0", "inf"}, "upper: found 'inf', expected a finite number, m or rad"},
           {{"1,2", "0", "0", "1"}, "joints: found 2 numbers, expected 12"}}) {
    try {
      shapes.span(span);
      ADD_FAILURE() << reason;
    } catch (const std::invalid_argument& error) {
      EXPECT_EQ(error.what(), reason);
    }
  }
}

TEST(Shapes, RefuseWrongJointsWithTheReason) {
  const Shapes shapes(robot(), "rigid");
  for (const auto& [joints, reason] :
       std::map<std::string, std::string>{{"", "joints: found 0 numbers, expected 12"},
                                          {"1,2", "joints: found 2 numbers, expected 12"},
                                          {"1,x", "joints: found 'x', expected a finite number, m or rad"},
                                          {"1,nan", "joints: found 'nan', expected a finite number, m or rad"},
                                          {"1,,2", "joints: found '', expected a finite number, m or rad"}}) {
    try {
      shapes.at(joints);
      ADD_FAILURE() << joints;
    } catch (const std::invalid_argument& error) {
      EXPECT_EQ(error.what(), reason);
    }
  }
}

}  // namespace
}  // namespace tandem::console
