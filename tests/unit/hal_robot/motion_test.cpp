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

/// The largest change of a setpoint's speed between two commands, per second: m/s^2 and rad/s^2.
std::pair<double, double> slewOfReversal(const HardwareConfig& config, std::uint64_t& actions) {
  System system(config);
  EXPECT_TRUE(system.boot()) << system.story();
  EXPECT_TRUE(system.enable()) << system.story();
  std::pair<double, double> most{0.0, 0.0};
  ArmVector setpoint = system.robot->setpoint(0), speed = ArmVector::Zero(6);
  std::uint64_t seen = system.robot->answersCommand();
  system.after_period = [&] {
    if (system.robot->answersCommand() == seen)
      return;
    seen = system.robot->answersCommand();
    const ArmVector now = (system.robot->setpoint(0) - setpoint) / System::kControlPeriod;
    const ArmVector change = (now - speed).cwiseAbs() / System::kControlPeriod;
    most = {std::max(most.first, change.head(3).maxCoeff()), std::max(most.second, change.tail(3).maxCoeff())};
    setpoint = system.robot->setpoint(0);
    speed = now;
  };
  for (const double sign : {1.0, -1.0, 1.0}) {
    system.move(0, sign * slow(4e-3, 1.5));
    system.run(0.5);
  }
  EXPECT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
  actions = system.robot->guards()[safety::Guard::kSlew].count;
  return most;
}

TEST(RobotHardware, LimitsTheSlewByDefaultAndNotWhereTheFileSaysSo) {
  std::uint64_t actions = 0;
  const auto limited = slewOfReversal(presetHardware(), actions);
  EXPECT_LE(limited.second, 20.0 * (1.0 + 1e-9)) << "rotations turn round from 1.5 rad/s within 20 rad/s^2";
  EXPECT_GT(actions, 0u);
  // Carriages at the robot's 5 mm/s have no acceleration limit at 10 Hz.
  EXPECT_NEAR(limited.first, 2 * 4e-3 / System::kControlPeriod, 1e-9);
  HardwareConfig config = presetHardware();
  for (ArmConfig& arm : config.arms) {
    for (safety::JointLimit& joint : arm.limits.joints)
      joint.slew_limit = safety::kUnlimited;
  }
  EXPECT_NEAR(slewOfReversal(config, actions).second, 2 * 1.5 / System::kControlPeriod, 1e-6);
  EXPECT_EQ(actions, 0u);
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
