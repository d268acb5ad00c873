// SPDX-License-Identifier: Apache-2.0
/** @file Limit switches at the drives: a joint may leave them, and not go farther. */
#include "tests/unit/hal_robot/robot_fixture.h"

namespace tandem::hal::test {
namespace {

constexpr double kFar = 4e-3;    // of each switch from the start, m
constexpr double kSpeed = 4e-3;  // m/s

/// The linear stages have switches on both sides of their start. @param read  the file names their inputs
struct Stages {
  HardwareConfig config;
  DriveKind kind;

  Stages(DriveMode mode, bool reversed, bool read) : config(presetHardware(mode)) {
    for (AxisConfig& axis : config.axes) {
      if (!axis.translation)
        continue;
      axis.gearing.reversed = reversed;
      axis.negative_switch = read ? 0 : -1;
      axis.positive_switch = read ? 1 : -1;
    }
    const double counts = kFar / AxisUnits(config.axes[0].gearing).resolution();
    kind.adapt = [counts](sim::drives::DriveSpec& drive) {
      if (drive.id > 3)
        return;  // rotations
      drive.switches.negative = drive.start - counts;
      drive.switches.positive = drive.start + counts;
    };
  }
};

bool isFault(System& system) { return system.robot->state(0) == OperatingState::kFault; }

void clear(System& system) {
  system.hold();
  system.command.request[0] = DriveRequest::kDisable;
  ASSERT_TRUE(system.until(5.0, [&] { return system.robot->state(0) == OperatingState::kDisabled; })) << system.story();
  system.command.request[0] = DriveRequest::kKeep;
  ASSERT_TRUE(system.enable()) << system.story();
}

class SwitchOfAStage : public testing::TestWithParam<std::tuple<DriveMode, bool, double>> {};

TEST_P(SwitchOfAStage, StopsAJointThatMovesOntoItAndLetsItLeave) {
  const auto [mode, reversed, direction] = GetParam();
  const Stages stages(mode, reversed, true);
  System system(stages.config, 0.0, stages.kind);
  ASSERT_TRUE(system.boot() && system.enable()) << system.story();
  const double start = system.truth(0, 0);
  const auto shown = [&] { return system.robot->arm(0).axis(0).limitSwitch(); };
  EXPECT_EQ(shown(), LimitSwitch::kNone);
  system.move(0, speeds(direction * kSpeed, 0.0));
  ASSERT_TRUE(system.until(3.0, [&] { return isFault(system); })) << system.story();
  EXPECT_GE(system.guardCount(HardwareGuard::kInternalLimit), 1u) << system.story();
  EXPECT_EQ(system.robot->faultRecord(0).cause, safety::FaultCause::kOutsideLimits);
  EXPECT_EQ(system.robot->state(1), OperatingState::kEnabled);
  system.run(0.5);
  EXPECT_EQ(shown(), direction < 0.0 ? LimitSwitch::kLower : LimitSwitch::kUpper);
  const double beyond = direction * (system.truth(0, 0) - start) - kFar;
  const double ramp = kSpeed * kSpeed / stages.config.axes[0].quick_stop_deceleration;
  EXPECT_GT(beyond, -0.1e-3);
  EXPECT_LT(beyond, ramp + 4.0 * stages.config.period * kSpeed + 0.25e-3) << "the last command, and the lag";

  clear(system);
  system.run(1.0);
  ASSERT_FALSE(isFault(system)) << "it may stand on the switch" << system.story();
  const std::uint64_t before = system.guardCount(HardwareGuard::kInternalLimit);
  system.move(0, speeds(direction * kSpeed, 0.0));
  ASSERT_TRUE(system.until(0.3, [&] { return isFault(system); })) << "but not go farther" << system.story();
  EXPECT_GT(system.guardCount(HardwareGuard::kInternalLimit), before);
  system.run(0.5);

  clear(system);
  system.move(0, speeds(-direction * kSpeed, 0.0));
  system.run(1.5);
  EXPECT_FALSE(isFault(system)) << system.story();
  EXPECT_LT(direction * (system.truth(0, 0) - start), 0.0);
  EXPECT_EQ(shown(), LimitSwitch::kNone);
}

std::string nameOf(const testing::TestParamInfo<std::tuple<DriveMode, bool, double>>& instance) {
  const auto [mode, reversed, direction] = instance.param;
  const char* name = mode == DriveMode::kCyclicPosition ? "Csp" : mode == DriveMode::kCyclicVelocity ? "Csv" : "Pv";
  return std::string(name) + (reversed ? "Reversed" : "") + (direction < 0.0 ? "Down" : "Up");
}

INSTANTIATE_TEST_SUITE_P(OfEach,
                         SwitchOfAStage,
                         testing::Combine(testing::Values(DriveMode::kCyclicPosition,
                                                          DriveMode::kCyclicVelocity,
                                                          DriveMode::kProfileVelocity),
                                          testing::Bool(),
                                          testing::Values(-1.0, 1.0)),
                         nameOf);

/// The inputs are in a PDO of their own, without which nobody knows where the joint is allowed to go.
TEST(LimitSwitches, ThatAreNotReceivedStopTheArm) {
  const Stages stages(DriveMode::kCyclicPosition, false, true);
  System system(stages.config, 0.0, stages.kind);
  ASSERT_TRUE(system.boot() && system.enable()) << system.story();
  system.run(0.2);
  system.wires[0]->bus.disturbance = [](can::CanFrame& frame) { return frame.id != 0x281; };
  EXPECT_TRUE(system.until(0.1, [&] { return isFault(system); }));
  EXPECT_GE(system.guardCount(HardwareGuard::kDriveSilent), 1u) << system.story();
}

TEST(LimitSwitches, ThatTheFileDoesNotNameAreNotRead) {
  const Stages stages(DriveMode::kProfileVelocity, false, false);
  System system(stages.config, 0.0, stages.kind);
  ASSERT_TRUE(system.boot() && system.enable()) << system.story();
  const double start = system.truth(0, 0);
  system.move(0, speeds(-kSpeed, 0.0));
  system.run(2.0);
  EXPECT_FALSE(isFault(system)) << system.story();
  EXPECT_LT(system.truth(0, 0), start - 1.5 * kFar);
}

}  // namespace
}  // namespace tandem::hal::test
