// SPDX-License-Identifier: Apache-2.0
/** @file Colours of the arms: of the page's description, the markers and the shipped layouts, from one palette. */
#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <regex>

#include "config/robot_files.h"
#include "services/console/api.h"
#include "services/console/markers.h"
#include "services/console/palette.h"

namespace tandem::console {
namespace {

constexpr int kTubes = 3;

std::string layout(const std::string& name) {
  std::ifstream file(std::string(TANDEM_SOURCE) + "/console/layouts/" + name);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(Palette, TheFirstArmIsBlueAndTheSecondOrange) {
  for (int tube = 0; tube < kTubes; ++tube) {
    const auto blue = rgba(tubeColor(0, tube, kTubes)), orange = rgba(tubeColor(1, tube, kTubes));
    EXPECT_GT(blue[2], blue[0]) << tube;
    EXPECT_GT(orange[0], orange[2]) << tube;
  }
  EXPECT_EQ(tubeColor(1, 0, 1), armColor(1));
}

TEST(Palette, TheDescriptionOfTheRobotHasIt) {
  const config::Deployment laptop = config::loadDeployment(config::findFile("laptop", "deployment"));
  const auto json = describeRobot(laptop, config::loadAnyRobot(laptop.robot));
  for (int arm = 0; arm < 2; ++arm) {
    const auto& one = json["arms"][static_cast<std::size_t>(arm)];
    EXPECT_EQ(one["color"], armColor(arm));
    ASSERT_EQ(one["tubes"].size(), kTubes);
    for (int tube = 0; tube < kTubes; ++tube)
      EXPECT_EQ(one["tubes"][static_cast<std::size_t>(tube)]["color"], tubeColor(arm, tube, kTubes));
  }
}

/// Curves of joint j of arm k have the colour of the tube that the joint moves.
TEST(Palette, TheLayoutsHaveIt) {
  const std::regex curve(
      R"re((?:name|"value")[=:] ?"/tandem/(?:actuation/\w+[/.]\w+\[(\d+)\]|arm_([ab])/measured_js\.position\[(\d)\])",?\s+"?color"?[=:] ?"(#\w+)")re");
  for (const char* name : {"plotjuggler.xml", "lichtblick.json"}) {
    const std::string text = layout(name);
    int found = 0;
    for (std::sregex_iterator one(text.begin(), text.end(), curve), end; one != end; ++one, ++found) {
      const std::smatch& match = *one;
      const bool by_arm = match[2].matched;
      const int index = std::stoi(match[by_arm ? 3 : 1]), arm = by_arm ? match[2] == "b" : index / 8;
      EXPECT_EQ(match[4], tubeColor(arm, index % 8 % kTubes, kTubes)) << name << ": " << match[0];
    }
    EXPECT_GE(found, 9) << name;
  }
}

TEST(TipMarkers, AreTheAxesOfItsFrame) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::srand(seed);
  for (int round = 0; round < 100; ++round) {
    dds::PoseStamped tip;
    tip.frame = "t_base";
    tip.stamp = 5;
    Eigen::Vector3d::Map(tip.position.data()) = Eigen::Vector3d::Random();
    const Eigen::Quaterniond turn = Eigen::Quaterniond::UnitRandom();
    Eigen::Vector4d::Map(tip.orientation.data()) = turn.coeffs();
    const dds::MarkerArray array = tipMarkersOf(tip, "arm_a");
    ASSERT_EQ(array.markers.size(), 3u);
    for (int axis = 0; axis < 3; ++axis) {
      const dds::Marker& line = array.markers[static_cast<std::size_t>(axis)];
      EXPECT_EQ(line.frame, "t_base");
      EXPECT_EQ(line.ns, "arm_a/tip");
      EXPECT_EQ(line.color[static_cast<std::size_t>(axis)], 1.0f);
      ASSERT_EQ(line.points.size(), 2u);
      const Eigen::Vector3d from = Eigen::Vector3d::Map(line.points[0].data()),
                            to = Eigen::Vector3d::Map(line.points[1].data());
      EXPECT_LT((from - Eigen::Vector3d::Map(tip.position.data())).norm(), 1e-12);
      EXPECT_LT(((to - from).normalized() - turn.toRotationMatrix().col(axis)).norm(), 1e-9);
    }
  }
}

TEST(Description, OfForbiddenRegionsAndTheWorkspace) {
  namespace teleoperation = planning::teleoperation;
  config::Deployment laptop = config::loadDeployment(config::findFile("laptop", "deployment"));
  const config::Robot robot = config::loadAnyRobot(laptop.robot);
  EXPECT_EQ(describeRobot(laptop, robot)["regions"]["forbidden"].size(), 0u);
  EXPECT_TRUE(describeRobot(laptop, robot)["regions"]["workspace"].is_null());
  auto& guard = laptop.teleoperation.options.guard;
  guard.workspace = teleoperation::Box{{-1, -2, 0}, {1, 2, 3}};
  guard.forbidden = {{"vessel", teleoperation::Sphere{{0, 1, 2}, 0.5}},
                     {"wall", teleoperation::HalfSpace{{0, 0, 4}, {0, 0, -1}}},
                     {"bone", teleoperation::Box{{0, 0, 0}, {1, 1, 1}}}};
  const auto regions = describeRobot(laptop, robot)["regions"];
  EXPECT_EQ(regions["workspace"]["max"], (std::vector<double>{1, 2, 3}));
  ASSERT_EQ(regions["forbidden"].size(), 3u);
  EXPECT_EQ(regions["forbidden"][0]["name"], "vessel");
  EXPECT_EQ(regions["forbidden"][0]["sphere"]["center"], (std::vector<double>{0, 1, 2}));
  EXPECT_EQ(regions["forbidden"][0]["sphere"]["radius"], 0.5);
  EXPECT_EQ(regions["forbidden"][1]["half_space"]["normal"], (std::vector<double>{0, 0, -1}));
  EXPECT_EQ(regions["forbidden"][2]["box"]["max"], (std::vector<double>{1, 1, 1}));
}

TEST(Description, OfTheOrientationsThatOperatorsCommandAndOfWhatTheArmsCannotTurn) {
  const auto described = [](const std::string& preset, planning::teleoperation::TipOrientation followed) {
    config::Deployment deployment = config::loadDeployment(config::findFile(preset, "deployment"));
    deployment.teleoperation.options.rotation.followed = followed;
    return describeRobot(deployment, config::loadAnyRobot(deployment.robot))["teleoperation"];
  };
  using enum planning::teleoperation::TipOrientation;
  const auto tubes = described("laptop", kIgnored);
  EXPECT_EQ(tubes["orientation"], "ignored");
  EXPECT_EQ(tubes["refused"]["axis"], "");
  EXPECT_EQ(tubes["refused"]["full"], "");
  EXPECT_EQ(described("laptop", kAxis)["orientation"], "axis");
  EXPECT_EQ(described("laptop", kFull)["orientation"], "full");
  const auto planar = described("planar-pair", kIgnored);
  EXPECT_NE(planar["refused"]["axis"].get<std::string>().find("turn its tip with rank 0"), std::string::npos) << planar;
  EXPECT_NE(planar["refused"]["full"].get<std::string>().find("expected rank 3"), std::string::npos) << planar;
  const auto catheters = described("ablation-pair", kIgnored);
  EXPECT_NE(catheters["refused"]["axis"].get<std::string>().find("no independent tips"), std::string::npos)
      << catheters;
}

}  // namespace
}  // namespace tandem::console
