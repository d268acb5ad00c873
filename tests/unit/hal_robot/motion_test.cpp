// SPDX-License-Identifier: Apache-2.0
#include "robot_fixture.h"

namespace tandem::hal::test {
namespace {

ArmVector slow(double translation, double rotation) {
  ArmVector v(6);
  v << translation, translation, translation, rotation, rotation, rotation;
  return v;
}

TEST(RobotHardware, BootsAllNodesAndKnowsWhereItIs) {
  System system;
  ASSERT_TRUE(system.boot()) << system.story();
  for (int arm = 0; arm < 2; ++arm) {
    EXPECT_TRUE(system.robot->valid(arm));
    EXPECT_EQ(system.robot->state(arm), OperatingState::kDisabled);
    for (int joint = 0; joint < 6; ++joint) {
      EXPECT_NEAR(system.robot->position(arm)[joint], system.truth(arm, joint), 1e-6);
      EXPECT_EQ(system.drive(arm, joint).record().travel, 0.0);
    }
  }
}

TEST(RobotHardware, EnablesWithoutAJump) {
  System system;
  ASSERT_TRUE(system.boot());
  const ArmVector before = system.truth(0);
  ASSERT_TRUE(system.enable()) << system.story();
  system.run(0.5);
  EXPECT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
  EXPECT_LE((system.truth(0) - before).cwiseAbs().maxCoeff(), 1e-7);
  for (int joint = 0; joint < 6; ++joint)
    EXPECT_LE(system.drive(0, joint).record().max_jump, 1.0) << "counts";
}

TEST(RobotHardware, FollowsItsCommander) {
  System system;
  ASSERT_TRUE(system.boot());
  ASSERT_TRUE(system.enable());
  const ArmVector start = system.truth(0), start_b = system.truth(1);
  system.move(0, slow(2e-3, 0.2));
  system.run(2.0);
  system.hold();
  system.run(1.0);
  EXPECT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
  const ArmVector moved = system.truth(0) - start;
  for (int j = 0; j < 6; ++j) {
    EXPECT_NEAR(moved[j] / (j < 3 ? 2e-3 : 0.2), 2.0, 0.25);
    EXPECT_NEAR(moved[j] / (j < 3 ? 2e-3 : 0.2), moved[0] / 2e-3, 1e-3) << "axes do not move together";
  }
  EXPECT_LE((system.truth(1) - start_b).cwiseAbs().maxCoeff(), 1e-7);
}

TEST(RobotHardware, ReversedAxesAndEncodersMoveTheSameWay) {
  HardwareConfig config = presetHardware();
  for (std::size_t i = 0; i < config.axes.size(); ++i) {
    config.axes[i].gearing.reversed = i % 2 == 0;
    config.axes[i].encoder->gearing.reversed = i % 3 == 0;
  }
  System system(config);
  ASSERT_TRUE(system.boot()) << system.story();
  ASSERT_TRUE(system.enable()) << system.story();
  const ArmVector start = system.truth(0);
  system.move(0, slow(2e-3, 0.2));
  system.run(1.0);
  EXPECT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
  for (int j = 0; j < 6; ++j)
    EXPECT_GT(system.truth(0)[j] - start[j], 0.5 * (j < 3 ? 2e-3 : 0.2));
}

}  // namespace
}  // namespace tandem::hal::test
