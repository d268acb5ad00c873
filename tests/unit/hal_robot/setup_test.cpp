// SPDX-License-Identifier: Apache-2.0
/** @file Objects of booted drives compared with the hardware file. */
#include "tests/unit/hal_robot/robot_fixture.h"

namespace tandem::hal::test {
namespace {

/** A booted system, and the object dictionary of each of its drives. */
class DriveSetup : public testing::Test {
 protected:
  void boot(const HardwareConfig& hardware) {
    system_ = std::make_unique<System>(hardware);
    ASSERT_TRUE(system_->boot()) << system_->story();
  }
  std::int64_t value(const AxisConfig& axis, int index, int sub = 0) {
    const auto at = static_cast<std::uint16_t>(index);
    return system_->drive(axis.arm, axis.joint).dictionary().require(at, static_cast<std::uint8_t>(sub)).value;
  }
  static double counts(const AxisConfig& axis, double size) { return size / std::abs(AxisUnits(axis.gearing).scale()); }

  std::unique_ptr<System> system_;
};

TEST_F(DriveSetup, FollowingErrorsAreWatchedAsTheFileSays) {
  boot(presetHardware());
  for (const AxisConfig& axis : system_->config.axes) {
    SCOPED_TRACE(axis.name);
    EXPECT_NEAR(static_cast<double>(value(axis, 0x6065)), counts(axis, axis.following_error), 1.0);
    EXPECT_EQ(value(axis, 0x6066), std::llround(1e3 * axis.following_time));
  }
}

TEST_F(DriveSetup, StopsAreRampsOfTheQuickStop) {
  HardwareConfig hardware = presetHardware();
  hardware.axes[0].brake.emplace();
  boot(hardware);
  for (const AxisConfig& axis : system_->config.axes) {
    SCOPED_TRACE(axis.name);
    EXPECT_EQ(value(axis, 0x6007), 3) << "loss of the connection: quick stop";
    EXPECT_EQ(value(axis, 0x605A), axis.brake ? 6 : 2)
        << "quick stop: its ramp; with a brake, torque until it is closed";
    EXPECT_EQ(value(axis, 0x605B), 1) << "shutdown: ramp";
    EXPECT_EQ(value(axis, 0x605C), 1) << "disable operation: ramp";
    EXPECT_EQ(value(axis, 0x605D), 2) << "halt: ramp of the quick stop";
    EXPECT_EQ(value(axis, 0x605E), 2) << "fault reaction: ramp of the quick stop";
    for (const int ramp : {0x6084, 0x6085})
      EXPECT_NEAR(static_cast<double>(value(axis, ramp)), counts(axis, axis.quick_stop_deceleration), 1.0);
  }
}

TEST_F(DriveSetup, SoftwareLimitsAreThoseOfTheFileAndTheRest) {
  boot(presetHardware());
  for (const AxisConfig& axis : system_->config.axes) {
    SCOPED_TRACE(axis.name);
    // Motor counts begin where the motor stood at the boot: distances from the present joint are compared.
    const double here = system_->robot->position(axis.arm)[axis.joint];
    const double motor = system_->drive(axis.arm, axis.joint).position();
    const double scale = AxisUnits(axis.gearing).scale();
    std::array<double, 2> limits{};
    for (int k = 0; k < 2; ++k)
      limits[static_cast<std::size_t>(k)] = here + scale * (static_cast<double>(value(axis, 0x607D, 1 + k)) - motor);
    const auto [lower, upper] = std::minmax(limits[0], limits[1]);
    const double tolerance = 2.5 * safety::kPositionTolerance + 3.0 * std::abs(scale);
    EXPECT_NEAR(lower, axis.lower, tolerance);
    EXPECT_NEAR(upper, axis.upper, tolerance);
    EXPECT_LE(lower, axis.lower);
    EXPECT_GE(upper, axis.upper);
  }
}

/// The drive's own counts do not change when somebody pushes the joint; only their difference from the target would.
TEST_F(DriveSetup, AJointThatWasPushedWithoutTorqueStaysWhereItIs) {
  boot(presetHardware());
  ASSERT_TRUE(system_->enable());
  system_->request(DriveRequest::kDisable);
  ASSERT_TRUE(system_->until(1.0, [&] { return system_->robot->off(); }));
  sim::drives::Drive& drive = system_->drive(0, 1);
  const double there = drive.motor().position() + 2e-3 / AxisUnits(system_->config.axes[1].gearing).scale();
  for (int k = 0; k < 500; ++k) {
    drive.motor().follow(there, 0.0, 1e-3);
    if (k % 4 == 0)
      system_->period();
  }
  system_->run(0.2);
  const double pushed = system_->truth(0, 1);
  ASSERT_TRUE(system_->enable()) << system_->story();
  double farthest = 0.0;
  system_->after_period = [&] { farthest = std::max(farthest, std::abs(system_->truth(0, 1) - pushed)); };
  system_->run(0.5);
  EXPECT_LE(farthest, 5e-6);
}

}  // namespace
}  // namespace tandem::hal::test
