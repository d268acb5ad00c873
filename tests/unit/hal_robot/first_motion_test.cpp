// SPDX-License-Identifier: Apache-2.0
/** @file The first motion after a boot: hardware files with wrong units, gearings and signs end it; right ones do not.
 */
#include "hal/first_motion.h"
#include "hal/run_motion.h"

#include <random>

#include "tests/unit/hal_robot/robot_fixture.h"

namespace tandem::hal::test {
namespace {

constexpr double kSlack = 0.2e-3, kTurnSlack = 0.01;

std::mt19937 seeded() {
  const auto seed = static_cast<unsigned>(::testing::UnitTest::GetInstance()->random_seed()) + 7u;
  std::printf("seed %u\n", seed);
  return std::mt19937(seed);
}
double uniform(std::mt19937& random, double least, double most) {
  return std::uniform_real_distribution<double>(least, most)(random);
}

/// Nothing but the first motion looks at small differences.
HardwareConfig lenient(DriveMode mode) {
  HardwareConfig config = presetHardware(mode);
  for (AxisConfig& axis : config.axes) {
    axis.first_motion = axis.translation ? kSlack : kTurnSlack;
    axis.following_error = axis.translation ? 5e-3 : 0.5;
    axis.encoder->tolerance = axis.translation ? 20e-3 : 2.0;
  }
  return config;
}

/// A HAL with this hardware file at drives that are as `right` says.
std::unique_ptr<System> systemWith(const HardwareConfig& right, const HardwareConfig& file) {
  auto system = std::make_unique<System>(right);
  system->replaceHal(file);
  return system;
}

/// Moves the first joint (or the first rotation) of arm A until something stops it. @return its true travel
double travel(System& system, int joint, double speed, double seconds) {
  const double before = system.truth(0, joint);
  ArmVector v = speeds(0.0, 0.0);
  v[joint] = speed;
  if (joint < 3)
    v.head(3).setConstant(speed);  // equation (1)
  system.move(0, v);
  system.until(seconds, [&] { return system.robot->state(0) == OperatingState::kFault; });
  system.run(0.3);
  return std::abs(system.truth(0, joint) - before);
}

/// The joint never leaves the range of its targets, however late it is: such a motion is confirmed.
TEST(FirstMotion, WhatLagsIsConfirmed) {
  std::mt19937 random = seeded();
  for (int run = 0; run < 200; ++run) {
    FirstMotion motion(kSlack);
    motion.begin(0.0, 0.0, 0.1);
    double target = 0.0, joint = 0.0, speed = 0.0;
    const double share = uniform(random, 0.01, 1.0), offset = uniform(random, -0.9, 0.9) * kSlack;
    for (int k = 0; k < 2000; ++k) {
      if (k % 100 == 0)
        speed = uniform(random, -0.1, 0.1);
      target += 4e-3 * speed;
      joint += share * (target - joint);
      motion.sample(target, joint, 0.1 + joint + offset);
      ASSERT_FALSE(motion.failed()) << run << " " << motion.excess();
    }
    EXPECT_TRUE(motion.confirmed());
  }
}

TEST(FirstMotion, AWrongGearingEndsIt) {
  std::mt19937 random = seeded();
  for (int run = 0; run < 12; ++run) {
    const DriveMode mode = run % 2 == 0 ? DriveMode::kCyclicPosition : DriveMode::kCyclicVelocity;
    const HardwareConfig right = lenient(mode);
    HardwareConfig file = right;
    const double factor = (run % 3 == 0 ? -1.0 : 1.0) * std::exp(uniform(random, 0.3, 1.5) * (run % 4 < 2 ? 1 : -1));
    const int joint = run % 5 == 0 ? 3 : 0;
    Gearing& gearing = file.axes[static_cast<std::size_t>(joint)].gearing;
    gearing.gear_ratio *= std::abs(factor);
    gearing.reversed = (factor < 0.0) != gearing.reversed;
    const auto system = systemWith(right, file);
    ASSERT_TRUE(system->boot()) << system->story();
    ASSERT_TRUE(system->enable()) << system->story();
    const double speed = joint < 3 ? uniform(random, 0.5e-3, 5e-3) : uniform(random, 0.05, 0.5);
    const double far = travel(*system, joint, -speed, 20.0);
    SCOPED_TRACE("gearing wrong by " + std::to_string(factor) + ", speed " + std::to_string(speed));
    ASSERT_EQ(system->robot->state(0), OperatingState::kFault);
    EXPECT_GE(system->guardCount(HardwareGuard::kFirstMotion), 1u) << system->story();
    const safety::FaultRecord record = system->robot->faultRecord(0);
    EXPECT_EQ(record.joint, joint);
    EXPECT_GT(record.amount, record.allowed);
    // The true travel t and what the file makes of it, t / factor, differ by `slack`; then the stop, after two periods.
    const double slack = joint < 3 ? kSlack : kTurnSlack, moved = speed * std::abs(factor);
    const AxisConfig& axis = right.axes[static_cast<std::size_t>(joint)];
    const double stop = moved * 3.0 * right.period + moved * moved / axis.quick_stop_deceleration;
    EXPECT_LT(far, slack / std::abs(1.0 - 1.0 / factor) + stop + 0.1 * slack);
  }
}

/// Drives whose unit the file takes for another one, and no encoder that could tell.
TEST(FirstMotion, AWrongUnitOfVelocityEndsIt) {
  for (const DriveMode mode : {DriveMode::kProfileVelocity, DriveMode::kCyclicVelocity}) {
    HardwareConfig right = lenient(mode), file = right;
    for (AxisConfig& axis : file.axes) {
      axis.reference = PositionReference::kDrive;
      axis.encoder.reset();
      axis.lower -= 10.0;  // where a drive's counter stands is not known
      axis.upper += 10.0;
      axis.units.velocity_scale = 16.0;
    }
    const auto system = systemWith(right, file);
    ASSERT_TRUE(system->boot()) << system->story();
    ASSERT_TRUE(system->enable()) << system->story();
    // The true joint is followed by the drives' encoders of the simulation.
    const sim::drives::Drive& drive = system->drive(0, 0);
    const double before = drive.motor().position();
    ArmVector v = speeds(-0.5e-3, 0.0);
    system->move(0, v);
    EXPECT_TRUE(system->until(5.0, [&] { return system->robot->state(0) == OperatingState::kFault; }));
    system->run(0.3);
    EXPECT_GE(system->guardCount(HardwareGuard::kFirstMotion), 1u) << system->story();
    const double far = std::abs((drive.motor().position() - before) * AxisUnits(right.axes[0].gearing).scale());
    EXPECT_LT(far, kSlack + 16 * 0.5e-3 * 0.1) << "a tenth of a second at a sixteenfold speed";
  }
}

/// The arm homes at kHomingSpeed with drives that take it for ten times as much; the run ends after `first_motion` and
/// the ramp.
constexpr double kHomingSpeed = 0.5e-3;
void expectHomingEnds(const HardwareConfig& right) {
  HardwareConfig file = right;
  for (AxisConfig& axis : file.axes)
    axis.units.velocity_scale = 10.0;
  const auto system = systemWith(right, file);
  EXPECT_FALSE(system->boot());
  const sim::drives::Motor& motor = system->drive(0, 0).motor();
  const double before = motor.position();
  EXPECT_EQ(homeArm(*system, 300), ArmHardware::HomingAnswer::kNotDisabled) << system->story();
  EXPECT_EQ(system->robot->state(0), OperatingState::kFault);
  EXPECT_GE(system->guardCount(HardwareGuard::kFirstMotion), 1u) << system->story();
  EXPECT_EQ(system->guardCount(HardwareGuard::kOverspeed), 0u) << "it is slower than the axis may move";
  const safety::FaultRecord record = system->robot->faultRecord(0);
  EXPECT_GT(record.amount, record.allowed);
  const double travel = std::abs((motor.position() - before) * AxisUnits(right.axes[0].gearing).scale());
  const double speed = 10 * kHomingSpeed, ramp = speed * speed / right.axes[0].quick_stop_deceleration;
  EXPECT_LT(travel, 2 * kFirstTranslation + ramp + 5 * right.period * speed);
}

TEST(FirstMotion, AHomingRunWithAWrongUnitOfVelocityEnds) {
  HardwareConfig right = homingHardware();
  for (AxisConfig& axis : right.axes)
    axis.homing.fast = axis.homing.slow = kHomingSpeed;
  expectHomingEnds(right);
}

/// Towards a mechanical stop the HAL commands the motion: drives in profile velocity.
TEST(FirstMotion, ARunAgainstAStopWithAWrongUnitOfVelocityEnds) {
  HardwareConfig right = homingHardware();
  for (AxisConfig& axis : right.axes) {
    if (axis.arm != 0 || !axis.translation)
      continue;
    axis.mode = DriveMode::kProfileVelocity;
    axis.reference = PositionReference::kHardStop;
    axis.hard_stop = {false, kHomingSpeed, 0.3, 0.04};
  }
  expectHomingEnds(right);
}

/// A drive sets its position to 0 at its reference: that is no travel. A run that is as fast as it should be is right.
TEST(FirstMotion, AHomingRunMayFindItsReferenceAtAnyTime) {
  std::mt19937 random = seeded();
  for (int run = 0; run < 200; ++run) {
    RunMotion motion(kSlack);
    const double speed = uniform(random, 1e-4, 2e-2), start = uniform(random, -1.0, 1.0),
                 reserve = uniform(random, 0.5, 1.4);
    const int found = std::uniform_int_distribution<int>(1, 500)(random);
    double position = start, direction = 1.0;
    motion.begin(-speed, speed, position, 0);
    for (int k = 1; k < 600; ++k) {
      if (k % 97 == 0)
        direction = -direction;
      position = k == found ? 0.0 : position + direction * 4e-3 * speed * reserve * (k < found ? 1.0 : 0.0);
      motion.sample(position, 4'000'000LL * k);
      ASSERT_FALSE(motion.failed()) << run << " " << k << " " << motion.excess();
    }
  }
}

TEST(FirstMotion, ARightFileMovesAtAnySpeed) {
  std::mt19937 random = seeded();
  for (const DriveMode mode : {DriveMode::kCyclicPosition, DriveMode::kCyclicVelocity, DriveMode::kProfileVelocity}) {
    System system(lenient(mode));
    ASSERT_TRUE(system.boot());
    ASSERT_TRUE(system.enable());
    for (int k = 0; k < 10; ++k) {
      system.move(0, speeds((k % 2 == 0 ? -1 : 1) * uniform(random, 0.1e-3, 5e-3), uniform(random, -2.0, 2.0)));
      system.run(0.5);
      ASSERT_EQ(system.robot->state(0), OperatingState::kEnabled) << static_cast<int>(mode) << system.story();
    }
  }
}

}  // namespace
}  // namespace tandem::hal::test
