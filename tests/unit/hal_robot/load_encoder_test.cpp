// SPDX-License-Identifier: Apache-2.0
/** @file Absolute encoders at the joints that the drives read (60E4), instead of encoders on the bus. */
#include "tests/unit/hal_robot/robot_fixture.h"

namespace tandem::hal::test {
namespace {

HardwareConfig throughDrives(DriveMode mode = DriveMode::kCyclicPosition) {
  HardwareConfig config = presetHardware(mode);
  for (AxisConfig& axis : config.axes) {
    axis.encoder->node = 0;
    axis.encoder->drive_input = 1;
  }
  return config;
}

TEST(LoadEncoder, IsTheReferenceAndNeedsNoNode) {
  for (const DriveMode mode : {DriveMode::kCyclicPosition, DriveMode::kCyclicVelocity, DriveMode::kProfileVelocity}) {
    SCOPED_TRACE(static_cast<int>(mode));
    System system(throughDrives(mode));
    for (const auto& wire : system.wires)
      EXPECT_TRUE(wire->drives->encoders().empty());
    ASSERT_TRUE(system.boot()) << system.story();
    ASSERT_TRUE(system.enable()) << system.story();
    const double start = system.truth(0, 0);
    system.move(0, speeds(-3e-3, 0.4));
    system.run(1.5);
    system.hold();
    system.run(0.5);
    EXPECT_NEAR(system.truth(0, 0), start - 4.5e-3, 0.5e-3);
    for (int arm = 0; arm < 2; ++arm) {
      for (int j = 0; j < 6; ++j)
        EXPECT_NEAR(system.robot->position(arm)[j], system.truth(arm, j), j < 3 ? 5e-5 : 5e-3) << arm << " " << j;
    }
    EXPECT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
  }
}

/// A single-turn encoder: its counts begin again within the travel of a boot, the position does not.
TEST(LoadEncoder, MayBeginAgainAfterItsRange) {
  HardwareConfig config = throughDrives();
  EncoderConfig& encoder = *config.axes[3].encoder;
  encoder.gearing.offset += 3.0;
  config.axes[3].lower = -3.0;
  config.axes[3].upper = 3.0;
  encoder.range = 2.0 * std::numbers::pi / AxisUnits(encoder.gearing).resolution();
  System system(config);
  ASSERT_TRUE(system.boot()) << system.story();
  ASSERT_TRUE(system.enable()) << system.story();
  const double before = system.robot->position(0)[3];
  ArmVector v = speeds(0.0, 0.0);
  v[3] = before > 0.0 ? -1.0 : 1.0;
  system.move(0, v);
  system.run(3.0);
  system.hold();
  system.run(0.5);
  EXPECT_NEAR(system.robot->position(0)[3] - before, 3.0 * v[3], 0.1) << system.story();
  EXPECT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
}

/// The motor's encoder fails, and the joint's does not: they disagree.
TEST(LoadEncoder, DisagreesWithAMotorEncoderThatFails) {
  System system(throughDrives());
  ASSERT_TRUE(system.boot() && system.enable()) << system.story();
  system.run(0.2);
  ASSERT_TRUE(system.inject(0, FaultKind::kWrong, 2, 50000));
  EXPECT_TRUE(system.until(0.1, [&] { return system.robot->state(0) == OperatingState::kFault; }));
  EXPECT_GE(system.guardCount(HardwareGuard::kEncoderMismatch), 1u) << system.story();
  EXPECT_EQ(system.robot->faultRecord(0).cause, safety::FaultCause::kDisagree);
  EXPECT_EQ(system.robot->state(1), OperatingState::kEnabled);
}

TEST(LoadEncoder, OfADriveWithoutTheObjectIsRefusedByName) {
  sim::drives::Eds eds = sim::drives::driveEds();
  std::erase_if(eds.objects, [](const auto& object) { return object.address.index == 0x60E4; });
  System system(throughDrives(), 0.0, eds);
  EXPECT_FALSE(system.boot());
  const canopen::Node& node = driveNode(system.robot->arm(0).axis(0));
  EXPECT_EQ(node.phase(), canopen::NodePhase::kFailed);
  EXPECT_NE(node.describeFailure().find("60E4"), std::string::npos) << node.describeFailure();
}

TEST(LoadEncoder, CostsNoNodeOnTheBus) {
  const BusTraffic before = presetHardware().trafficOf(0, 0.1), now = throughDrives().trafficOf(0, 0.1);
  EXPECT_EQ(before.encoders, 6);
  EXPECT_EQ(now.encoders, 0);
  EXPECT_EQ(now.drives, before.drives);
  double frames = 0.0;
  for (const double count : now.feedback)
    frames += count;
  EXPECT_EQ(frames, 12.0) << "statusword and position, 6 bytes, and the encoder in a second PDO";
}

}  // namespace
}  // namespace tandem::hal::test
