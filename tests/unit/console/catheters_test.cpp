// SPDX-License-Identifier: Apache-2.0
/** @file Console with catheters: JSON description, and drawn pose of the grasped object. */
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <random>

#include "config/robot_files.h"
#include "control/parameters.h"
#include "services/console/api.h"
#include "services/console/grasped_object.h"
#include "services/console/markers.h"

namespace tandem::console {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using kinematics::grasp::ContactType;

config::Deployment presetOf(const std::string& name) {
  return config::loadDeployment(config::findFile(name, "deployment"));
}

Isometry3d anyPose() { return Eigen::Translation3d(Vector3d::Random()) * Eigen::Quaterniond::UnitRandom(); }

/// An object with two random contacts.
config::GraspedObject held(ContactType type) {
  config::GraspedObject object;
  object.size = 0.01;
  for (int k = 0; k < 2; ++k) {
    kinematics::grasp::Contact contact;
    contact.type = type;
    contact.frame = anyPose();
    contact.hand = anyPose();
    object.contacts.push_back(contact);
    object.arms.push_back(k);
  }
  return object;
}

/// Tips that touch the object, each rotated about its contact point.
std::vector<Isometry3d> touching(const config::GraspedObject& object, const Isometry3d& at, bool turned) {
  std::vector<Isometry3d> tips;
  for (const auto& contact : object.contacts) {
    Isometry3d turn = Isometry3d::Identity();
    if (turned)
      turn.linear() = Eigen::Quaterniond::UnitRandom().toRotationMatrix();
    tips.push_back(at * contact.frame * turn * contact.hand.inverse());
  }
  return tips;
}

TEST(GraspedObjectPose, AGrippedObjectIsWhereItsTipsAre) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::srand(seed);
  for (int round = 0; round < 100; ++round) {
    const config::GraspedObject object = held(ContactType::kRigid);
    const Isometry3d at = anyPose();
    EXPECT_LT((objectPose(object, touching(object, at, false)).matrix() - at.matrix()).norm(), 1e-12);
  }
}

TEST(GraspedObjectPose, BetweenPointsItLiesAsItsPointsDo) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::srand(seed);
  for (int round = 0; round < 100; ++round) {
    const config::GraspedObject object = held(ContactType::kPoint);
    const std::vector<Isometry3d> tips = touching(object, anyPose(), true);
    const Isometry3d found = objectPose(object, tips);
    for (std::size_t k = 0; k < tips.size(); ++k) {
      const Vector3d touch = tips[k] * object.contacts[k].hand.translation();
      EXPECT_LT((found * object.contacts[k].frame.translation() - touch).norm(), 1e-12);
    }
  }
}

TEST(GraspedObjectPose, IsDrawnAsACubeOfItsSize) {
  const Isometry3d at = anyPose();
  const dds::MarkerArray array = markersOf(held(ContactType::kRigid), at, "t_base", 5);
  ASSERT_EQ(array.markers.size(), 1u);
  const dds::Marker& cube = array.markers[0];
  EXPECT_EQ(cube.type, 1);
  EXPECT_EQ(cube.frame, "t_base");
  EXPECT_EQ(cube.ns, "object");
  EXPECT_EQ(cube.stamp, 5);
  EXPECT_GT(cube.lifetime, 0);
  EXPECT_GT(cube.color[3], 0.0f);
  for (int k = 0; k < 3; ++k) {
    EXPECT_DOUBLE_EQ(cube.scale[static_cast<std::size_t>(k)], 0.01);
    EXPECT_DOUBLE_EQ(cube.position[static_cast<std::size_t>(k)], at.translation()[k]);
  }
  const auto& q = cube.orientation;
  EXPECT_LT((Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix() - at.linear()).norm(), 1e-12);
}

TEST(Description, OfCathetersThatHoldAnObject) {
  const config::Deployment deployment = presetOf("ablation-pair");
  const config::Robot robot = config::loadAnyRobot(deployment.robot);
  const auto json = describeRobot(deployment, robot);
  ASSERT_EQ(json["arms"].size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) {
    const auto& arm = json["arms"][k];
    EXPECT_EQ(arm["type"], "catheter");
    EXPECT_EQ(arm["joint_count"], 3);
    ASSERT_EQ(arm["tubes"].size(), 1u);
    EXPECT_NEAR(arm["tubes"][0]["outer_radius"].get<double>(), 2.333e-3 / 2, 1e-9);
    EXPECT_NEAR(arm["tubes"][0]["length"].get<double>(), 0.120 + 0.065 + 0.015, 1e-9);
    EXPECT_NEAR(arm["base"]["position"][0].get<double>(), k == 0 ? -63.38e-3 : 63.38e-3, 1e-9);
    EXPECT_EQ(arm["tubes"][0]["name"], "catheter");
    std::vector<std::string> names;
    for (const auto& joint : arm["joints"]) {
      names.push_back(joint["name"]);
      for (const char* words : {"symbol", "title", "part"})
        EXPECT_EQ(joint[words], names.back());
      EXPECT_EQ(joint["translation"], names.size() == 1);
    }
    EXPECT_EQ(names, (std::vector<std::string>{"insertion", "roll", "bend"}));
  }
  EXPECT_EQ(json["capabilities"]["tips"], false);
  EXPECT_EQ(json["capabilities"]["common_path"], true);
  EXPECT_EQ(json["capabilities"]["computation"], false);
  EXPECT_EQ(json["object"]["size"], 0.014);
  ASSERT_EQ(json["object"]["contacts"].size(), 2u);
  EXPECT_EQ(json["object"]["contacts"][1]["arm"], "arm_b");
  EXPECT_EQ(json["object"]["contacts"][1]["type"], "rigid");
  std::vector<std::string> paths;
  for (const auto& path : describeTrajectories(robot))
    paths.push_back(path["name"]);
  EXPECT_EQ(paths, (std::vector<std::string>{"lift", "tip-eight"}));
}

TEST(Description, OfTubesAndOfAssistedCathetersHasNoObject) {
  const config::Deployment laptop = presetOf("laptop"), assist = presetOf("ablation-assist");
  const config::Robot tubes = config::loadAnyRobot(laptop.robot);
  const auto json = describeRobot(laptop, tubes);
  EXPECT_TRUE(json["object"].is_null());
  ASSERT_EQ(json["warnings"].size(), 1u);
  EXPECT_EQ(json["warnings"][0].get<std::string>().find("at home arm_a and arm_b overlap"), 0u);
  EXPECT_EQ(json["arms"][0]["type"], "concentric_tube");
  EXPECT_EQ(json["arms"][0]["joints"][0]["name"], "beta_1");
  EXPECT_EQ(json["arms"][0]["joints"][3]["name"], "alpha_1");
  EXPECT_EQ(json["arms"][0]["joints"][4]["symbol"], "α2");
  EXPECT_EQ(json["arms"][0]["joints"][4]["title"], "rotation of tube 2");
  EXPECT_EQ(json["arms"][0]["joints"][4]["part"], "tube 2");
  EXPECT_EQ(json["capabilities"]["tips"], true);
  EXPECT_EQ(json["capabilities"]["common_path"], false);
  EXPECT_EQ(json["arms"][0]["joints"][2]["translation"], true);
  EXPECT_EQ(json["arms"][0]["joints"][3]["translation"], false);
  for (const auto& trajectory : describeTrajectories(tubes))
    EXPECT_NE(trajectory["yaml"].get<std::string>().find("trajectory/1"), std::string::npos);
  EXPECT_TRUE(describeRobot(assist, config::loadAnyRobot(assist.robot))["object"].is_null());
}

TEST(Description, ParametersHaveTheUnitsAndMeaningsOfTheirKeys) {
  const config::Deployment laptop = presetOf("laptop");
  const auto parameters = describeRobot(laptop, config::loadAnyRobot(laptop.robot))["control"]["parameters"];
  EXPECT_EQ(parameters.size(), 2 + control::kTunableParameters.size());
  std::map<std::string, std::string> units;
  for (const auto& parameter : parameters) {
    units[parameter["name"]] = parameter["unit"];
    EXPECT_NE(parameter["meaning"], "") << parameter["name"];
    EXPECT_GT(parameter["value"].get<double>(), 0) << parameter["name"];
  }
  EXPECT_EQ(units["tip_gain"], "1/s");
  EXPECT_EQ(units["nsp_damping"], "m");
  EXPECT_EQ(units["rotation_velocity"], "rad/s");
  EXPECT_EQ(units["track_weight"], "");
  EXPECT_EQ(parameters[0]["methods"].size(), control::kMethodCount + 1u);
}

TEST(Page, TrajectoriesThatTheRobotCannotRunHaveTheReason) {
  const config::Robot one = config::loadAnyRobot(config::findFile("timc2024", "robot"));
  const config::Robot two = config::loadAnyRobot(config::findFile("ark2024", "robot"));
  int refused = 0;
  for (const auto& trajectory : describeTrajectories(one)) {
    const auto reason = trajectory["refused"].get<std::string>();
    const bool of_one_arm = trajectory["name"] == "circle-one-arm" || trajectory["name"] == "remote-centre" ||
                            trajectory["name"] == "follow-the-leader";
    EXPECT_EQ(reason.empty(), of_one_arm) << trajectory["name"];
    refused += reason.find("found arm b") != std::string::npos ? 1 : 0;
  }
  EXPECT_GE(refused, 4);
  // What the form of the page does not show, and would lose.
  const std::map<std::string, std::vector<std::string>> further{{"remote-centre", {"remote_centre"}},
                                                                {"relative-pose", {"relative_pose"}},
                                                                {"follow-the-leader", {"follow_the_leader"}},
                                                                {"needle-passing", {"relative_orientation"}}};
  for (const auto& trajectory : describeTrajectories(two)) {
    EXPECT_EQ(trajectory["refused"], "") << trajectory["name"];
    const auto& spec = trajectory["spec"];
    EXPECT_EQ(spec["shape"].size(), 1u) << trajectory["name"];
    EXPECT_GE(spec["values"]["points"], 40) << trajectory["name"];
    const auto expected = further.find(trajectory["name"].get<std::string>());
    EXPECT_EQ(spec["further"], expected == further.end() ? std::vector<std::string>{} : expected->second)
        << trajectory["name"];
    if (trajectory["name"] == "circle") {
      EXPECT_EQ(spec["values"]["max_iterations"], 1000);
      EXPECT_EQ(spec["values"]["points"], 100);
      EXPECT_EQ(spec["shape"]["circle"]["center_offset"], (std::vector<double>{0, 0.01, 0}));
      EXPECT_EQ(spec["values"]["speed"], 0.002);
      EXPECT_EQ(spec["other_arm"], 1);
    }
  }
}

/// The tests of the page read descriptions.json, generated from idl/ together with the C++ of the server.
TEST(ServedNames, MatchTheIdl) {
  std::ifstream file(TANDEM_DESCRIPTIONS);
  const auto expected = nlohmann::json::parse(file);
  ASSERT_GT(expected.size(), 20u);
  const config::Deployment laptop = presetOf("laptop");
  auto served = describeRobot(laptop, config::loadAnyRobot(laptop.robot))["descriptions"];
  for (auto& fault : served["Fault"])
    EXPECT_EQ(fault.erase("remedy"), 1u) << fault;
  EXPECT_EQ(nlohmann::json::parse(served.dump()), expected);
}

}  // namespace
}  // namespace tandem::console
