// SPDX-License-Identifier: Apache-2.0
#include "robot_fixture.h"

#include "services/hal/hal_events.h"
#include "tests/unit/safety/allocation_counter.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::hal::test {
namespace {

/// True position of a homing axis: the simulated motor counts with the joint's own gearing.
double carriage(System& system, int joint) {
  const AxisConfig& axis = system.config.axes[static_cast<std::size_t>(joint)];
  return AxisUnits(axis.gearing).scale() * system.drive(0, joint).motor().position() + axis.gearing.offset;
}

/// Homes the first arm to its end.
void homeArm(System& system) {
  ArmHardware::HomingAnswer answer = system.robot->home(0, system.now);
  EXPECT_EQ(answer, ArmHardware::HomingAnswer::kRunning);
  for (int i = 0; i < 2000 && answer == ArmHardware::HomingAnswer::kRunning; ++i) {
    system.run(0.1);
    answer = system.robot->home(0, system.now);
  }
  ASSERT_EQ(answer, ArmHardware::HomingAnswer::kDone) << system.story();
}

TEST(Homing, IsReportedAndRequiredBeforeEnabling) {
  System system(homingHardware());
  EXPECT_FALSE(system.boot());
  EXPECT_FALSE(system.robot->arm(0).homed());
  EXPECT_FALSE(system.robot->valid(0));
  EXPECT_TRUE(system.robot->arm(1).homed());
  system.request(DriveRequest::kEnable);
  system.run(1.0);
  EXPECT_EQ(system.robot->state(0), OperatingState::kDisabled);
  EXPECT_EQ(system.robot->arm(0).power(), ArmPower::kOff);
}

TEST(Homing, CarriagesKeepEquationOneOnTheWay) {
  System system(homingHardware());
  system.boot();
  const safety::ArmLimits& limits = system.config.arms[0].limits;
  ArmVector q = ArmVector::Zero(6);
  for (int j = 0; j < 3; ++j)
    q[j] = carriage(system, j);
  ASSERT_LE(safety::largestViolation(limits, q), 0.0) << "the simulated start has to be a good one";
  double worst = -1.0;
  system.after_period = [&] {
    for (int j = 0; j < 3; ++j)
      q[j] = carriage(system, j);
    for (const safety::LinearRow& row : limits.rows)
      worst = std::max(worst, safety::rowValue(row, q) - row.b);
  };
  homeArm(system);
  EXPECT_LE(worst, 0.1e-3);
  EXPECT_EQ(system.robot->arm(0).power(), ArmPower::kOff);
  for (int j = 0; j < 3; ++j)
    EXPECT_NEAR(system.robot->position(0)[j], carriage(system, j), 0.5e-3);
  ASSERT_TRUE(system.enable()) << system.story();
}

/// Methods of a manufacturer, as a profile describes them: the simulated drives run them, the HAL knows only their
/// number.
TEST(Homing, AMethodOfTheManufacturerEndsAtTheMechanicalStop) {
  for (const bool index : {false, true}) {
    SCOPED_TRACE(index);
    HardwareConfig hardware = homingHardware();
    for (AxisConfig& axis : hardware.axes) {
      if (axis.reference != PositionReference::kHoming)
        continue;
      axis.homing.method = index ? -2 : -4;
      axis.homing.stop = -1;
      axis.homing.stop_index = index;
    }
    System system(hardware);
    system.boot();
    homeArm(system);
    for (int j = 0; j < 3; ++j)
      EXPECT_NEAR(system.robot->position(0)[j], carriage(system, j), 0.5e-3);
    ASSERT_TRUE(system.enable()) << system.story();
  }
}

TEST(Homing, EndsWithoutRepeatedRequests) {
  System system(homingHardware());
  system.boot();
  ASSERT_EQ(system.robot->home(0, system.now), ArmHardware::HomingAnswer::kRunning);
  system.run(0.9);
  EXPECT_TRUE(system.robot->arm(0).homing());
  system.run(0.8);
  EXPECT_FALSE(system.robot->arm(0).homing());
  const double before = carriage(system, 0);
  system.run(1.0);
  EXPECT_NEAR(carriage(system, 0), before, 1e-6);
  EXPECT_FALSE(system.robot->arm(0).homed());
}

TEST(Homing, OneAxisThatFailsStopsItsGroup) {
  System system(homingHardware());
  system.boot();
  system.robot->home(0, system.now);
  system.run(0.8);
  ASSERT_TRUE(system.robot->arm(0).homing());
  ASSERT_TRUE(system.inject(0, FaultKind::kOverCurrent, 2));
  EXPECT_TRUE(system.until(0.5, [&] { return !system.robot->arm(0).homing(); })) << system.story();
  EXPECT_EQ(system.robot->state(0), OperatingState::kFault);
  system.run(0.3);
  const double first = carriage(system, 0), last = carriage(system, 2);
  system.run(1.0);
  EXPECT_NEAR(carriage(system, 0), first, 1e-6);
  EXPECT_NEAR(carriage(system, 2), last, 1e-6);
}

/// The rotations of arm A home by this method, each to another position; the carriages keep their encoders.
HardwareConfig rotationsThatHome(int method) {
  HardwareConfig config = presetHardware();
  for (AxisConfig& axis : config.axes) {
    if (axis.arm != 0 || axis.translation)
      continue;
    axis.reference = PositionReference::kHoming;
    axis.encoder.reset();
    axis.first_motion = kFirstRotation;
    axis.homing = {method, 1.0, 0.1, 10.0, 0.3 * axis.joint, 0, 60.0};
  }
  return config;
}

class HomingMethod : public testing::TestWithParam<int> {};

TEST_P(HomingMethod, EndsWithAKnownPositionAndTheArmCanBeEnabled) {
  System system(rotationsThatHome(GetParam()));
  EXPECT_FALSE(system.boot());
  ASSERT_EQ(homeArm(system, 1000), ArmHardware::HomingAnswer::kDone) << system.story();
  for (int j = 3; j < 6; ++j) {
    EXPECT_NEAR(system.robot->position(0)[j], carriage(system, j), 2e-3) << "joint " << j;
    EXPECT_NEAR(carriage(system, j), 0.3 * j, 0.1) << "the motor stands near its reference";
  }
  ASSERT_TRUE(system.enable()) << system.story();
  system.move(0, speeds(0.0, 0.2));
  system.run(1.0);
  system.hold();
  system.run(1.0);
  for (int j = 3; j < 6; ++j)
    EXPECT_NEAR(carriage(system, j), system.robot->setpoint(0)[j], 2e-3);
}

INSTANTIATE_TEST_SUITE_P(
    Vocabulary,
    HomingMethod,
    testing::Values(1, 4, 8, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 33, 34, 35, 37));

TEST(Homing, AMissingSwitchIsAFaultAndNothingMoves) {
  for (const int method : {17, 19, 23}) {
    SCOPED_TRACE(method);
    DriveKind kind;
    kind.switches = false;
    System system(rotationsThatHome(method), 0.0, kind);
    system.boot();
    const double before = carriage(system, 3);
    EXPECT_EQ(homeArm(system, 1000), ArmHardware::HomingAnswer::kNotDisabled);
    EXPECT_EQ(system.robot->state(0), OperatingState::kFault);
    EXPECT_EQ(system.guardCount(HardwareGuard::kHoming), 3u) << system.story();
    EXPECT_EQ(homingFailures(system), std::vector(3, HomingFailure::kDrive));
    EXPECT_FALSE(system.robot->arm(0).homed());
    EXPECT_EQ(system.robot->arm(0).power(), ArmPower::kOff);
    EXPECT_EQ(carriage(system, 3), before);
  }
}

TEST(Homing, ARunThatOutlastsItsBudgetSaysSo) {
  HardwareConfig config = homingHardware();
  for (AxisConfig& axis : config.axes) {
    if (axis.reference == PositionReference::kHoming)
      axis.homing.budget = 0.5;
  }
  System system(config);
  system.boot();
  homeArm(system, 1000);
  EXPECT_EQ(homingFailures(system), std::vector(3, HomingFailure::kLate)) << system.story();
  const auto guard = std::ranges::find(system.events, HomingFailure::kLate, &HardwareEvent::homing);
  ASSERT_NE(guard, system.events.end());
  EXPECT_NE(hal_service::describe(*guard, *system.robot).find("homing: the run has not ended within `budget`"),
            std::string::npos);
}

TEST(CyclicVelocity, HoldsItsPlaceAndFollows) {
  HardwareConfig config = presetHardware();
  for (AxisConfig& axis : config.axes)
    axis.mode = axis.translation ? DriveMode::kCyclicVelocity : DriveMode::kCyclicPosition;
  System system(config);
  ASSERT_TRUE(system.boot()) << system.story();
  ASSERT_TRUE(system.enable()) << system.story();
  const ArmVector start = system.truth(0);
  system.run(1.0);
  EXPECT_LE((system.truth(0) - start).cwiseAbs().maxCoeff(), 2e-6);
  ArmVector v = ArmVector::Zero(6);
  v.head(3).setConstant(2e-3);
  system.move(0, v);
  system.run(2.0);
  system.hold();
  system.run(2.0);
  EXPECT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
  for (int j = 0; j < 3; ++j)
    EXPECT_NEAR(system.truth(0)[j], system.robot->setpoint(0)[j], 5e-6);
}

TEST(PeriodicPath, AllocatesNothing) {
  if (!tandem::test::canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  System system;
  std::size_t allocations = 0;
  const auto counted = [&](double seconds) {
    const std::int64_t end = system.now + static_cast<std::int64_t>(1e9 * seconds);
    while (system.now < end) {
      const bool alive = std::exchange(system.hal_alive, false);
      system.period();  // the drives alone
      system.hal_alive = alive;
      const std::size_t before = tandem::test::allocationCount();
      if (system.now - system.last_command >= 100 * kMillisecond) {
        system.last_command = system.now;
        system.send();
      }
      system.robot->step(system.now);
      HardwareEvent event;
      while (system.robot->nextEvent(event)) {
      }
      allocations += tandem::test::allocationCount() - before;
    }
  };
  system.robot->start(system.now);
  counted(2.0);
  ASSERT_TRUE(system.allHomed());
  system.request(DriveRequest::kEnable);
  counted(1.0);
  ASSERT_TRUE(system.all(OperatingState::kEnabled));
  system.request(DriveRequest::kKeep);
  ArmVector v = ArmVector::Constant(6, 1e-3);
  system.move(0, v);
  counted(1.0);
  ASSERT_TRUE(system.inject(0, FaultKind::kOff, 2, 0.0, 0.5));
  counted(1.0);
  EXPECT_EQ(system.robot->state(0), OperatingState::kFault);
  system.hold();
  system.request(DriveRequest::kDisable);
  counted(4.0);
  EXPECT_EQ(system.robot->state(0), OperatingState::kDisabled);
  EXPECT_EQ(allocations, 0u);
}

}  // namespace
}  // namespace tandem::hal::test
