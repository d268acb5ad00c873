// SPDX-License-Identifier: Apache-2.0
#include "support.h"

namespace tandem::config::test {
namespace {

TEST(RobotPresets, Timc2024HasTheTubesOfItsParameterFile) {
  const Robot robot = loadRobot(presets() / "robots/timc2024.yaml");
  EXPECT_EQ(robot.warnings, std::vector<std::string>{});
  EXPECT_DOUBLE_EQ(robot.parameters.period, 0.025);
  ASSERT_EQ(robot.arms.size(), 1u);
  const Arm& arm = robot.arms[0];
  ASSERT_EQ(arm.model.tubeCount(), 3);
  const double length[] = {0.463, 0.3305, 0.199}, curvature[] = {10.0, 5.0, 7.0};
  const double outer[] = {1.524e-3, 1.8e-3, 2.35e-3}, inner[] = {1.3e-3, 1.62e-3, 2.06e-3};
  for (int i = 0; i < 3; ++i) {
    const kinematics::Tube& tube = arm.model.tubes[i];
    EXPECT_DOUBLE_EQ(tube.length(), length[i]);
    EXPECT_DOUBLE_EQ(tube.sections[1].length, 0.05);
    EXPECT_DOUBLE_EQ(tube.sections[1].curvature, curvature[i]);
    EXPECT_DOUBLE_EQ(tube.outer_diameter, outer[i]);
    EXPECT_DOUBLE_EQ(tube.inner_diameter, inner[i]);
    EXPECT_NEAR(tube.torsionalStiffness() / tube.bendingStiffness(), 1.0 / 1.3, 1e-12);
    EXPECT_DOUBLE_EQ(arm.limits.joints[i].velocity, 5e-3);
    EXPECT_DOUBLE_EQ(arm.limits.joints[i].approach_acceleration, 2.5e-3);
  }
  EXPECT_LT(safety::largestViolation(arm.limits, arm.home), 0.0);
}

}  // namespace
}  // namespace tandem::config::test
