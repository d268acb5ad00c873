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

TEST(Shapes, SayWhatIsWrongWithTheJoints) {
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
