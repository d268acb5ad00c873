// SPDX-License-Identifier: Apache-2.0
/** @file Robots of drives that the data sheets of tests/sheets describe, in simulated time: each mode that they have.
 */
#include "tests/unit/hal_robot/robot_fixture.h"

namespace tandem::hal::test {
namespace {

using enum DriveMode;

/** A sheet, the modes of its drive, and what the hardware file says of the drive. */
struct Vendor {
  std::string sheet;
  std::vector<DriveMode> modes;
  DriveUnits units;
  std::function<void(AxisConfig&)> adapt = [](AxisConfig&) {};
};

/// No heartbeat consumer, one object in a PDO, no reaction and no ramp of its own.
void guardAndAccept(AxisConfig& axis) {
  axis.watch = MutualWatch::kNodeGuarding;
  axis.pdo_objects = 1;
  for (const Protection loss : {Protection::kConnectionReaction, Protection::kQuickStopRamp})
    axis.accepted.push_back({loss, "a test"});
}

std::vector<Vendor> vendors() {
  const DriveUnits counts, rpm{RateUnit::kRevolutionsPerMinute, RateUnit::kRevolutionsPerMinute, 1.0, 1.0};
  const DriveUnits revolutions{RateUnit::kRevolutionsPerMinute, RateUnit::kRevolutionsPerSecond, 1.0, 1.0};
  const DriveUnits tenths{RateUnit::kCounts, RateUnit::kCounts, 10.0, 0.1};
  return {{"epos4", {kCyclicPosition, kCyclicVelocity, kProfileVelocity}, rpm},
          {"gold", {kCyclicPosition, kCyclicVelocity}, counts},
          {"mc3", {kCyclicPosition, kProfileVelocity}, revolutions},
          {"ipos", {kProfileVelocity}, counts, guardAndAccept},
          {"c5e", {kCyclicPosition, kCyclicVelocity, kProfileVelocity}, rpm},
          {"accelnet", {kProfileVelocity}, tenths}};
}

TEST(VendorSheets, AreAllTriedHere) {
  std::set<std::string> files, tried;
  for (const auto& entry : std::filesystem::directory_iterator(std::string(TANDEM_SOURCE) + "/tests/sheets"))
    files.insert(entry.path().filename().string());
  for (const Vendor& vendor : vendors())
    tried.insert(vendor.sheet + "-like.eds");
  EXPECT_EQ(files, tried);
}

TEST(VendorSheets, TheirDrivesBootMoveAndStand) {
  for (const Vendor& vendor : vendors()) {
    const auto sheet = canopen::loadEds(std::string(TANDEM_SOURCE) + "/tests/sheets/" + vendor.sheet + "-like.eds");
    for (const DriveMode mode : vendor.modes) {
      SCOPED_TRACE(vendor.sheet + ", mode " + std::to_string(static_cast<int>(mode)));
      HardwareConfig config = presetHardware(mode);
      for (AxisConfig& axis : config.axes) {
        axis.units = vendor.units;
        axis.temperature_index = 0;  // 2001 is another object of each of them
        vendor.adapt(axis);
      }
      System system(config, 0.0, sheet);
      ASSERT_TRUE(system.boot()) << system.story() << driveNode(system.robot->arm(0).axis(0)).describeFailure();
      ASSERT_TRUE(system.enable()) << system.story();
      expectMoves(system, 4e-3, 0.3);
      EXPECT_EQ(system.drive(0, 0).record().faults, 0u);
    }
  }
}

}  // namespace
}  // namespace tandem::hal::test
