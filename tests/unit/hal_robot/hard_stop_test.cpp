// SPDX-License-Identifier: Apache-2.0
/** @file Runs against a mechanical stop that gives way: found by torque, with a bounded travel after contact. */
#include "robot_fixture.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::hal::test {
namespace {

constexpr double kTorque = 0.3, kRated = 1e3;  // per mille
constexpr double kStart = 10e-3;               // from the stop, m

/// The linear stages of arm A push against their negative stops.
HardwareConfig stopHardware(DriveMode mode = DriveMode::kCyclicPosition) {
  HardwareConfig config = homingHardware();
  for (AxisConfig& axis : config.axes) {
    if (axis.arm != 0 || !axis.translation)
      continue;
    axis.mode = mode;
    axis.reference = PositionReference::kHardStop;
    axis.hard_stop = {false, 5e-3, kTorque, 0.04};
    axis.lower = axis.homing.position;
    axis.upper = axis.lower + 2.0 * kStart;
  }
  return config;
}

/// Counts beyond the stop, and the drive's torque limit.
struct Contact {
  double deepest = 0.0;
  std::int64_t least_torque = 1 << 20;
  void watch(System& system, int joint) {
    sim::drives::Drive& drive = system.drive(0, joint);
    deepest = std::max(deepest, drive.motor().parameters().low - drive.motor().position());
    least_torque = std::min(least_torque, drive.dictionary().find({0x6072, 0})->value);
  }
};

class HardStop : public testing::TestWithParam<DriveMode> {};

TEST_P(HardStop, IsFoundWithABoundedTravelAfterContact) {
  System system(stopHardware(GetParam()));
  EXPECT_FALSE(system.boot());
  EXPECT_EQ(system.robot->arm(0).axis(0).phase(), AxisPhase::kUnhomed);
  Contact contacts[3];
  system.after_period = [&] {
    for (int j = 0; j < 3; ++j)
      contacts[j].watch(system, j);
  };
  ASSERT_EQ(homeArm(system, 300), ArmHardware::HomingAnswer::kDone) << system.story();
  for (int j = 0; j < 3; ++j) {
    SCOPED_TRACE(j);
    const AxisConfig& axis = system.config.axes[static_cast<std::size_t>(j)];
    const sim::drives::Motor& motor = system.drive(0, j).motor();
    const double gives = kRated * kTorque / motor.parameters().end_stiffness;  // with the torque limit, counts
    // At most what the torque limit bends, and how deep the mass of the motor runs into a critically damped spring.
    const double stiffness = motor.parameters().end_stiffness * motor.parameters().max_acceleration / (2.0 * kRated);
    const double speed = axis.hard_stop.speed / AxisUnits(axis.gearing).resolution();
    EXPECT_GE(contacts[j].deepest, 0.8 * gives);
    EXPECT_LE(contacts[j].deepest, 1.1 * (gives + speed / (std::exp(1.0) * std::sqrt(stiffness))));
    EXPECT_EQ(contacts[j].least_torque, std::llround(kRated * kTorque));
    EXPECT_EQ(system.drive(0, j).dictionary().find({0x6072, 0})->value, 2000) << "as before the run";
    EXPECT_EQ(system.drive(0, j).record().faults, 0u);
    const double scale = AxisUnits(axis.gearing).scale();
    const double place = axis.homing.position + scale * (motor.position() - motor.parameters().low);
    EXPECT_NEAR(system.robot->position(0)[j], place, std::abs(1.2 * gives * scale));
  }
  EXPECT_EQ(system.robot->arm(0).power(), ArmPower::kOff);
  ASSERT_TRUE(system.enable()) << system.story();
  const double before = system.drive(0, 0).motor().position();
  system.move(0, speeds(1e-3, 0.0));
  system.run(1.0);
  system.hold();
  system.run(0.5);
  EXPECT_NEAR(AxisUnits(system.config.axes[0].gearing).scale() * (system.drive(0, 0).motor().position() - before), 1e-3,
              0.2e-3);
}

INSTANTIATE_TEST_SUITE_P(Vocabulary,
                         HardStop,
                         testing::Values(DriveMode::kCyclicPosition,
                                         DriveMode::kCyclicVelocity,
                                         DriveMode::kProfileVelocity));

TEST(HardStops, AMissingStopEndsTheRunAfterTheRangeOfTheAxis) {
  DriveKind kind;
  kind.switches = false;  // and no ends
  System system(stopHardware(), 0.0, kind);
  system.boot();
  const double before = system.drive(0, 0).motor().position();
  EXPECT_EQ(homeArm(system, 300), ArmHardware::HomingAnswer::kNotDisabled);
  EXPECT_GT(system.guardCount(HardwareGuard::kHoming), 0u) << system.story();
  const std::vector<HomingFailure> failures = homingFailures(system);
  EXPECT_EQ(std::ranges::count(failures, HomingFailure::kNoStop), std::ssize(failures));
  EXPECT_EQ(system.robot->state(0), OperatingState::kFault);
  EXPECT_EQ(system.robot->arm(0).power(), ArmPower::kOff);
  const double travel =
      AxisUnits(system.config.axes[0].gearing).scale() * (before - system.drive(0, 0).motor().position());
  EXPECT_LE(travel, 1.1 * 2.0 * kStart + 1e-3);
}

TEST(HardStops, TorqueWhileMovingIsNoStop) {
  AxisConfig axis = stopHardware().axes[0];
  for (std::uint32_t seed = tandem::test::baseSeed(); seed < tandem::test::baseSeed() + 200; ++seed) {
    SCOPED_TRACE(tandem::test::trace(seed));
    tandem::test::Random random(seed);
    axis.hard_stop.time = random.uniform(0.02, 0.2);
    axis.hard_stop.speed = random.uniform(1e-3, 8e-3);
    axis.hard_stop.positive = random.uniform(0.0, 1.0) > 0.5;
    const double period = 4e-3, direction = axis.hard_stop.positive ? 1.0 : -1.0;
    HardStopSearch search(axis, period);
    const double stop = random.uniform(1e-3, 15e-3), friction = random.uniform(0.0, 0.5);
    std::int64_t now = 1'000'000'000;
    search.start(now);
    double position = 0.0, contact_time = 0.0;
    for (int k = 0; k < 10000 && !search.found() && !search.lost(); ++k) {
      now += static_cast<std::int64_t>(1e9 * period);
      // A stiff joint: it follows the target up to the stop, with a friction that may exceed the limit.
      position = direction * std::min(stop, direction * search.target());
      const bool at_stop = direction * position >= stop;
      contact_time += at_stop ? period : 0.0;
      const bool pressed = direction * (search.target() - position) > 1e-4;
      search.step(position, direction * (at_stop && pressed ? 0.31 : friction), now);
      ASSERT_LE(std::abs(search.target() - position), 0.5 * axis.following_error + 1e-12);
      ASSERT_FALSE(search.found() && !at_stop) << "found in motion";
    }
    EXPECT_TRUE(search.found());
    EXPECT_NEAR(search.contact(), direction * stop, 0.2e-3);
    EXPECT_GE(contact_time, 0.9 * axis.hard_stop.time - 2.0 * period) << "it stands within a tenth of the way";
  }
}

}  // namespace
}  // namespace tandem::hal::test
