// SPDX-License-Identifier: Apache-2.0
/** @file Emergency stop signal from drives: it stops all arms, latches, and can be cleared. */
#include "robot_fixture.h"

namespace tandem::hal::test {
namespace {

using safety::EmergencyStop;
using safety::FaultCause;

HardwareConfig without(HardwareConfig config) {
  config.emergency_stop.clear();
  return config;
}

/// STO of every drive of the first bus, by the statusword.
HardwareConfig bySto() {
  HardwareConfig config = without(presetHardware());
  for (int axis = 0; axis < 6; ++axis)
    config.emergency_stop.push_back({axis, true, 14, false});
  return config;
}

void moveBoth(System& system) {
  ASSERT_TRUE(system.boot()) << system.story();
  EXPECT_EQ(system.robot->emergencyStop(), EmergencyStop::kReleased);
  ASSERT_TRUE(system.enable()) << system.story();
  system.move(0, speeds(4e-3, 0.3));
  system.move(1, speeds(1e-3, 0.1));
  system.run(0.5);
  ASSERT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
}

void expectRecord(const System& system) {
  for (int arm = 0; arm < 2; ++arm) {
    const safety::FaultRecord& record = system.robot->faultRecord(arm);
    EXPECT_NE(record.faults & safety::bit(Fault::kStopRequested), 0u) << safety::describe(record);
    EXPECT_EQ(record.cause, FaultCause::kEmergencyStop) << safety::describe(record);
  }
}

/// While it is pressed, `disable` and `enable` have no effect; afterwards they do, and nothing has moved.
void expectRecovery(System& system) {
  system.hold();
  system.request(DriveRequest::kDisable);
  system.run(4.0);  // a boot of the nodes included
  system.send();    // but not until the next period
  EXPECT_TRUE(system.all(OperatingState::kFault));
  system.request(DriveRequest::kEnable);
  system.run(1.0);
  EXPECT_TRUE(system.all(OperatingState::kFault));
  EXPECT_TRUE(system.robot->off());
  EXPECT_EQ(system.robot->emergencyStop(), EmergencyStop::kPressed);
  const ArmVector stood = system.truth(0);
  system.wires[0]->drives->clear(0, FaultKind::kEmergencyStop);
  system.request(DriveRequest::kKeep);
  system.run(0.5);
  EXPECT_EQ(system.robot->emergencyStop(), EmergencyStop::kReleased);
  EXPECT_TRUE(system.all(OperatingState::kFault)) << "it is latched";
  system.request(DriveRequest::kDisable);
  ASSERT_TRUE(system.until(8.0, [&] { return system.all(OperatingState::kDisabled) && system.allHomed(); }))
      << system.story();
  ASSERT_TRUE(system.enable()) << system.story();
  system.run(0.3);
  EXPECT_LE((system.truth(0) - stood).head(3).cwiseAbs().maxCoeff(), 5e-6);
  EXPECT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
}

TEST(EmergencyStop, OfAllDrivesStopsAllArmsLatchesAndIsRecoveredFrom) {
  System system;
  moveBoth(system);
  const ArmVector before = system.truth(1);
  ASSERT_TRUE(system.inject(0, FaultKind::kEmergencyStop, 0));
  const std::int64_t pressed = system.now;
  ASSERT_TRUE(system.until(0.1, [&] { return system.all(OperatingState::kFault); })) << system.story();
  EXPECT_LE(system.now - pressed, 3 * 4 * kMillisecond);
  EXPECT_EQ(system.robot->emergencyStop(), EmergencyStop::kPressed);
  expectRecord(system);
  EXPECT_EQ(system.guardCount(HardwareGuard::kEmergencyStop), 1u);
  // The arm whose drives still have torque stops with the ramp.
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->off(); })) << system.story();
  EXPECT_EQ(system.robot->faults(1), safety::bit(Fault::kStopRequested));
  EXPECT_LE((system.truth(1) - before).head(3).cwiseAbs().maxCoeff(), 1e-3 * 0.05);
  EXPECT_LE(safety::largestViolation(system.config.arms[0].limits, system.truth(0)), 0.3e-3);
  expectRecovery(system);
}

TEST(EmergencyStop, IsReadFromTheStatuswordToo) {
  System system(bySto());
  moveBoth(system);
  ASSERT_TRUE(system.inject(0, FaultKind::kEmergencyStop, 5));  // one drive's STO is sufficient
  ASSERT_TRUE(system.until(0.1, [&] { return system.all(OperatingState::kFault); })) << system.story();
  expectRecord(system);
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->off(); })) << system.story();
  expectRecovery(system);
}

TEST(EmergencyStop, WithoutAnInputItIsALossOfPowerOfOneArm) {
  System system(without(presetHardware()));
  ASSERT_TRUE(system.boot());
  ASSERT_TRUE(system.enable());
  ASSERT_TRUE(system.inject(0, FaultKind::kEmergencyStop, 0));
  system.run(0.5);
  EXPECT_EQ(system.robot->emergencyStop(), EmergencyStop::kNotRead);
  EXPECT_EQ(system.robot->faultRecord(0).cause, FaultCause::kOff);
  EXPECT_EQ(system.robot->state(1), OperatingState::kEnabled);
}

TEST(EmergencyStop, PressedInDisabledLatchesAndKeepsPowerAway) {
  System system;
  ASSERT_TRUE(system.inject(1, FaultKind::kEmergencyStop, 0));
  system.robot->start(system.now);
  system.request(DriveRequest::kEnable);
  system.run(5.0);
  EXPECT_TRUE(system.all(OperatingState::kFault)) << system.story();
  EXPECT_TRUE(system.robot->off());
  expectRecord(system);
}

TEST(EmergencyStop, LostInputStopsAllArms) {
  HardwareConfig config = presetHardware();
  config.emergency_stop.resize(1);  // on the first bus only
  System system(config);
  moveBoth(system);
  ASSERT_TRUE(system.inject(0, FaultKind::kOff, 1));
  ASSERT_TRUE(system.until(0.3, [&] { return system.all(OperatingState::kFault); })) << system.story();
  EXPECT_EQ(system.robot->faultRecord(1).cause, FaultCause::kEmergencyStop);
  EXPECT_EQ(system.robot->faultRecord(0).cause, FaultCause::kNoAnswer) << "nobody has pressed it";
  EXPECT_EQ(system.robot->emergencyStop(), EmergencyStop::kNotRead);
  // When the drive returns, so does the signal: the boot requested by `disable` restores both.
  system.hold();
  system.wires[0]->drives->clear(0, std::nullopt);
  system.request(DriveRequest::kDisable);
  ASSERT_TRUE(system.until(8.0, [&] { return system.all(OperatingState::kDisabled) && system.allHomed(); }))
      << system.story();
  EXPECT_EQ(system.robot->emergencyStop(), EmergencyStop::kReleased);
  EXPECT_TRUE(system.enable()) << system.story();
}

/// An arm may be recovered without the input only if the input was lost before, and only while it is recovered.
TEST(EmergencyStop, LostInputStopsARecoveryThatBeganWithIt) {
  HardwareConfig config = presetHardware();
  config.emergency_stop.resize(1);  // on the first bus
  System system(config);
  ASSERT_TRUE(system.boot());
  const auto recovers = [&] {
    system.command.request[1] = DriveRequest::kRecover;
    const bool does = system.until(5.0, [&] { return system.robot->recovering(1); });
    system.command.request[1] = DriveRequest::kKeep;
    system.run(0.2);
    return does && system.robot->recovering(1);
  };
  const auto stops = [&] {
    return system.until(0.3, [&] { return system.robot->state(1) == OperatingState::kFault; });
  };
  ASSERT_TRUE(recovers()) << system.story();
  ASSERT_TRUE(system.inject(0, FaultKind::kOff, 1));
  ASSERT_TRUE(stops()) << system.story();
  EXPECT_EQ(system.robot->faultRecord(1).cause, FaultCause::kEmergencyStop);
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->off(); })) << system.story();
  ASSERT_TRUE(recovers()) << "without the input that was lost before: " << system.story();
  system.request(DriveRequest::kDisable);
  ASSERT_TRUE(stops()) << "the recovery has ended: " << system.story();
  EXPECT_EQ(system.robot->faultRecord(1).cause, FaultCause::kEmergencyStop);
}

TEST(EmergencyStop, ReportsOfOthersCountAndSoDoesTheirSilence) {
  System system(without(presetHardware()), 0.5);
  ASSERT_TRUE(system.boot());
  system.request(DriveRequest::kEnable);
  system.run(1.0);
  EXPECT_TRUE(system.all(OperatingState::kDisabled)) << "nobody has said yet that it is released";
  bool pressed = false, talks = true;
  system.after_period = [&] {
    if (talks)
      system.robot->onEmergencyStop(pressed, system.now);
  };
  ASSERT_TRUE(system.enable()) << system.story();
  EXPECT_EQ(system.robot->emergencyStop(), EmergencyStop::kReleased);
  const auto stops_and_is_cleared = [&](const char* why) {
    ASSERT_TRUE(system.until(0.6, [&] { return system.all(OperatingState::kFault); })) << why;
    expectRecord(system);
    system.request(DriveRequest::kDisable);
    system.run(1.0);
    EXPECT_TRUE(system.all(OperatingState::kFault)) << why;
    pressed = false;
    talks = true;
    ASSERT_TRUE(system.until(1.0, [&] { return system.all(OperatingState::kDisabled); })) << why;
    ASSERT_TRUE(system.enable()) << why;
  };
  pressed = true;
  stops_and_is_cleared("pressed");
  talks = false;
  stops_and_is_cleared("silent");
}

TEST(EmergencyStop, AnotherInputReplacesALostOne) {
  System system;
  moveBoth(system);
  ASSERT_TRUE(system.inject(0, FaultKind::kOff, 1));
  system.run(0.5);
  EXPECT_EQ(system.robot->state(0), OperatingState::kFault);
  EXPECT_EQ(system.robot->state(1), OperatingState::kEnabled) << system.story();
  EXPECT_EQ(system.robot->emergencyStop(), EmergencyStop::kReleased);
  ASSERT_TRUE(system.inject(1, FaultKind::kEmergencyStop, 0));
  EXPECT_TRUE(system.until(0.1, [&] { return system.all(OperatingState::kFault); }));
}

/// All frames with inputs are lost, while everything else of the drives goes on.
TEST(EmergencyStop, AnInputThatIsNoLongerReceivedCountsAsPressed) {
  System system;
  moveBoth(system);
  for (const EmergencyInput& input : system.config.emergency_stop) {
    const AxisConfig& axis = system.config.axes[static_cast<std::size_t>(input.axis)];
    const auto id = static_cast<std::uint32_t>(0x280 + axis.node);
    system.wires[static_cast<std::size_t>(axis.bus)]->bus.disturbance = [id](const can::CanFrame& frame) {
      return frame.id != id;
    };
  }
  const double budget = std::max(system.config.feedback_budget, 3.0 * system.config.period);
  EXPECT_TRUE(system.until(budget + 3.0 * system.config.period, [&] { return system.all(OperatingState::kFault); }))
      << system.story();
  EXPECT_NE(system.robot->faults(0) & safety::bit(Fault::kStopRequested), 0u);
  EXPECT_EQ(system.robot->emergencyStop(), EmergencyStop::kNotRead);
}

}  // namespace
}  // namespace tandem::hal::test
