// SPDX-License-Identifier: Apache-2.0
#include "robots/overlap.h"

#include <gtest/gtest.h>

#include <regex>

#include "config/robot_files.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::robots {
namespace {

config::Robot preset() { return config::loadAnyRobot(std::filesystem::path(TANDEM_PRESETS) / "robots/ark2024.yaml"); }

/// Two equal arms with equal joints are parallel curves: their bodies overlap by the outermost tube's diameter at the
/// entry, less the distance of the bases.
TEST(Overlap, OfParallelArmsIsTheirDiameterLessTheirDistance) {
  std::uint32_t seed = test::baseSeed();
  SCOPED_TRACE(test::trace(seed));
  test::Random random(seed);
  for (int i = 0; i < 50; ++i) {
    config::Robot robot = preset();
    const double diameter = robot.arms[0].model.tubes.back().outer_diameter;
    const double distance = random.uniform(0.2, 1.8) * diameter;
    robot.arms[1].model = robot.arms[0].model;
    robot.arms[1].model.base.translation() = robot.arms[0].model.base.translation() + Eigen::Vector3d(0, distance, 0);
    const Eigen::VectorXd straight = (Eigen::VectorXd(6) << -0.33, -0.21, -0.1, 0, 0, 0).finished();
    const auto texts = describeOverlaps(robot, RobotModel(robot), {straight, straight});
    if (distance > diameter) {
      EXPECT_TRUE(texts.empty()) << distance;
      continue;
    }
    ASSERT_EQ(texts.size(), 1u) << distance;
    std::smatch found;
    ASSERT_TRUE(std::regex_match(
        texts[0], found,
        std::regex("arm_a and arm_b overlap by ([0-9.e-]+) mm: tube 3 of arm_a, tube 3 of arm_b, z = .* mm")))
        << texts[0];
    EXPECT_NEAR(std::stod(found[1]), 1e3 * (diameter - distance), 0.006 * 1e3 * diameter) << texts[0];
  }
}

TEST(Overlap, AtHomeIsNamedForThePresetAndNotForArmsFarApart) {
  config::Robot robot = preset();
  const auto texts = describeHomeOverlaps(robot);
  ASSERT_EQ(texts.size(), 1u);
  EXPECT_TRUE(texts[0].starts_with("at home arm_a and arm_b overlap by 0.147 mm: tube")) << texts[0];
  robot.arms[1].model.base.translation().y() -= 0.1;
  EXPECT_TRUE(describeHomeOverlaps(robot).empty());
}

TEST(Overlap, IsUnknownForRobotsWithoutModelsOfArms) {
  const auto pair = config::loadAnyRobot(std::filesystem::path(TANDEM_PRESETS) / "cooperative/ablation-pair.yaml");
  EXPECT_TRUE(describeHomeOverlaps(pair).empty());
}

}  // namespace
}  // namespace tandem::robots
