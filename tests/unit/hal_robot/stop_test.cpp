// SPDX-License-Identifier: Apache-2.0
/** @file Stops of drives: torque is removed at measured standstill, not at standstill of the reference. */
#include "hal/measured_motion.h"
#include "tests/unit/hal_robot/robot_fixture.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::hal::test {
namespace {

constexpr double kFast = 8e-3;  ///< m/s
constexpr int kMoving = 1;      ///< the only joint that moves
constexpr int kNode = 2;        ///< its drive

double scaleOf(System& system, int arm, int joint) {
  return AxisUnits(system.robot->arm(arm).axis(joint).config().gearing).scale();
}
/// Speed of the motor, m/s or rad/s.
double speedOf(System& system, int arm, int joint) {
  return std::abs(scaleOf(system, arm, joint) * system.drive(arm, joint).motor().velocity());
}
bool withoutTorque(sim::drives::DriveState state) {
  using State = sim::drives::DriveState;
  return state == State::kNotReady || state == State::kSwitchOnDisabled || state == State::kReady ||
         state == State::kSwitchedOn;
}

/** Checks that no drive of an arm loses its torque by command while its motor moves. */
struct TorqueWatch {
  explicit TorqueWatch(System& watched) : system(watched) {
    system.after_period = [this] {
      for (int j = 0; j < 6; ++j) {
        const sim::drives::Drive& drive = system.drive(0, j);
        if (withoutTorque(drive.state()))
          fastest = std::max(fastest, speedOf(system, 0, j) / system.config.axes[static_cast<std::size_t>(j)].velocity);
      }
    };
  }
  System& system;
  double fastest = 0.0;  ///< as a fraction of the axis' limit
};

/// Greatest measured speed of a joint at standstill, as a fraction.
constexpr double kRestShare = 0.025;

ArmVector oneJoint(double speed) {
  ArmVector v = ArmVector::Zero(6);
  v[kMoving] = speed;
  return v;
}

/// The arm's linear stages fall without torque and brake.
HardwareConfig brakedHardware() {
  HardwareConfig config = presetHardware();
  for (AxisConfig& axis : config.axes) {
    if (axis.arm == 0 && axis.translation) {
      axis.brake.emplace();
      axis.brake->slip = 50e-6;
    }
  }
  return config;
}

struct StopCase {
  const char* name;
  FaultKind kind;
  int node;
  double value;
  DriveMode mode = DriveMode::kCyclicPosition;
  double noticed = 0.0;  ///< s, in addition to the periods of every fault
};

class StopOfOneAxis : public testing::TestWithParam<StopCase> {};

TEST_P(StopOfOneAxis, IsItsQuickStopAndTorqueGoesAfterwards) {
  const StopCase& stop = GetParam();
  System system(presetHardware(stop.mode));
  // As shipped by some vendors: a slow ramp for all stops other than the quick stop.
  for (auto& drive : system.wires[0]->drives->drives())
    drive->dictionary().require(0x6084).value = 20'000;
  ASSERT_TRUE(system.boot()) << system.story();
  ASSERT_TRUE(system.enable()) << system.story();
  system.move(0, oneJoint(kFast));
  system.run(0.6);
  const TorqueWatch watch(system);
  const double before = system.truth(0, kMoving);
  ASSERT_TRUE(system.inject(0, stop.kind, stop.node, stop.value));
  ASSERT_TRUE(system.until(0.3, [&] { return system.robot->state(0) == OperatingState::kFault; })) << system.story();
  EXPECT_TRUE(system.until(0.8, [&] { return system.robot->arm(0).power() == ArmPower::kOff; })) << system.story();
  system.run(0.1);
  // Three periods until the detection, the ramp, and the motor's lag; a velocity loop lags by its gain.
  const AxisConfig& axis = system.config.axes[kMoving];
  const double lag = targetIsVelocity(stop.mode) ? 1.0 / axis.velocity_gain : 0.02;
  const double allowed =
      kFast * (stop.noticed + 4.0 * system.config.period + lag) + kFast * kFast / (2.0 * axis.quick_stop_deceleration);
  EXPECT_LE(std::abs(system.truth(0, kMoving) - before), allowed);
  EXPECT_LE(watch.fastest, kRestShare) << "torque went from a joint that moved";
}

/// A healthy drive whose encoder fails uses its own ramp at once, not after the others have stopped along theirs.
TEST(Stops, TheFailedAxisBeginsWhileTheOthersStillMove) {
  System system;
  ASSERT_TRUE(system.boot());
  ASSERT_TRUE(system.enable());
  ArmVector v = oneJoint(kFast);
  v[3] = 1.5;
  system.move(0, v);
  system.run(0.6);
  ASSERT_TRUE(system.inject(0, FaultKind::kEncoderAlarm, 16 + kNode, 0));
  ASSERT_TRUE(system.until(0.3, [&] { return system.robot->state(0) == OperatingState::kFault; }));
  const std::int64_t noticed = system.now;
  EXPECT_FALSE(system.robot->arm(0).supervisor().standing());
  system.run(0.5);
  const std::int64_t begin = system.drive(0, kMoving).record().stop_begin;
  EXPECT_LE(std::abs(begin - noticed), 4e9 * system.config.period);
}

INSTANTIATE_TEST_SUITE_P(
    Vocabulary,
    StopOfOneAxis,
    testing::Values(StopCase{"ItsEncoderIsWrong", FaultKind::kWrong, 16 + kNode, 50000},
                    StopCase{"ItsEncoderAlarms", FaultKind::kEncoderAlarm, 16 + kNode, 0},
                    StopCase{"ItsFeedbackIsLate", FaultKind::kDelayed, kNode, 300, DriveMode::kCyclicPosition, 0.032},
                    StopCase{"AnotherDriveFails", FaultKind::kOverCurrent, 3, 0},
                    StopCase{"AnotherEncoderAlarms", FaultKind::kEncoderAlarm, 19, 0},
                    StopCase{"Velocity", FaultKind::kEncoderAlarm, 16 + kNode, 0, DriveMode::kCyclicVelocity},
                    StopCase{"ProfileVelocity", FaultKind::kEncoderAlarm, 16 + kNode, 0, DriveMode::kProfileVelocity}),
    [](const auto& instance) { return instance.param.name; });

TEST(Stops, DisablingAMovingArmTakesTorqueFromAStandingOne) {
  System system;
  ASSERT_TRUE(system.boot() && system.enable());
  system.move(0, ArmVector::Constant(6, kFast));
  system.run(0.5);
  const TorqueWatch watch(system);
  system.request(DriveRequest::kDisable);
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->arm(0).power() == ArmPower::kOff; }));
  EXPECT_LE(watch.fastest, kRestShare);
}

TEST(Stops, ASlowRampIsNotTakenForARunaway) {
  HardwareConfig config = presetHardware();
  for (AxisConfig& axis : config.axes)
    axis.quick_stop_deceleration = axis.translation ? 0.015 : 3.0;
  System system(config);
  ASSERT_TRUE(system.boot() && system.enable());
  system.move(0, oneJoint(kFast));
  system.run(0.6);
  const TorqueWatch watch(system);
  ASSERT_TRUE(system.inject(0, FaultKind::kEncoderAlarm, 16 + kNode));
  ASSERT_TRUE(system.until(3.0, [&] { return system.robot->arm(0).power() == ArmPower::kOff; })) << system.story();
  EXPECT_LE(watch.fastest, kRestShare);
}

/// The arm's linear stages require homing, and stop slowly.
HardwareConfig withHoming(HardwareConfig config) {
  for (AxisConfig& axis : config.axes) {
    if (axis.arm != 0 || !axis.translation)
      continue;
    axis.reference = PositionReference::kHoming;
    axis.quick_stop_deceleration = 0.1;
    axis.homing = {17, 0.01, 0.002, 0.2, axis.lower + 0.01, 0, 60.0};
  }
  return config;
}

/// Homes at full speed, ends the request, and waits for the end.
void letGoOfHoming(System& system) {
  system.boot();
  const TorqueWatch watch(system);
  ASSERT_EQ(system.robot->home(0, system.now), ArmHardware::HomingAnswer::kRunning);
  ASSERT_TRUE(system.until(1.0, [&] { return speedOf(system, 0, 0) > 9e-3; })) << system.story();
  ASSERT_TRUE(system.until(3.0, [&] { return !system.robot->arm(0).homing(); })) << system.story();
  EXPECT_LE(watch.fastest, kRestShare);
  system.after_period = nullptr;
}

TEST(Stops, AbortedHomingRunEndsItsRampWithTorque) {
  System system(withHoming(presetHardware()));
  letGoOfHoming(system);
  EXPECT_LE(speedOf(system, 0, 0), kRestShare * 0.01);
}

TEST(Stops, ARunawayIsNoticedByItsMeasuredSpeed) {
  System system;
  ASSERT_TRUE(system.boot() && system.enable());
  for (const int node : {kNode, 5}) {
    const int joint = node - 1;
    const double before = system.truth(0, joint);
    ASSERT_TRUE(system.inject(0, FaultKind::kRunaway, node));
    ASSERT_TRUE(system.until(0.04, [&] { return system.robot->state(0) == OperatingState::kFault; }));
    // The joint runs away because the torque itself drives it: torque is removed as soon as the quick stop has no
    // effect.
    system.run(0.2);
    const double distance = std::abs(system.truth(0, joint) - before);
    const double fastest = 2.0 * system.config.axes[static_cast<std::size_t>(joint)].velocity;
    EXPECT_LE(distance, fastest * 0.1) << "at " << fastest << " per s";
    EXPECT_EQ(system.robot->state(1), OperatingState::kEnabled);
    system.wires[0]->drives->clear(0, std::nullopt);
    system.request(DriveRequest::kDisable);
    ASSERT_TRUE(system.until(8.0, [&] { return system.all(OperatingState::kDisabled) && system.allHomed(); }));
    ASSERT_TRUE(system.enable()) << system.story();
  }
  EXPECT_GE(system.guardCount(HardwareGuard::kOverspeed), 1u);
}

TEST(Stops, OverspeedStopsEvenWhereTheReferenceIsFast) {
  // Following error and first motion are not watched: only the measured speed remains.
  HardwareConfig config = presetHardware();
  for (AxisConfig& axis : config.axes) {
    axis.following_error = axis.translation ? 0.05 : 5.0;
    axis.first_motion = safety::kUnlimited;
  }
  System system(config);
  ASSERT_TRUE(system.boot() && system.enable());
  ASSERT_TRUE(system.inject(0, FaultKind::kRunaway, kNode));
  ASSERT_TRUE(system.until(0.04, [&] { return system.robot->state(0) == OperatingState::kFault; }));
  EXPECT_EQ(system.robot->faultRecord(0).cause, safety::FaultCause::kOverspeed);
}

TEST(Stops, OverspeedCountsInBothDirections) {
  constexpr std::int64_t kPeriod = 4'000'000;  // ns
  for (const double direction : {-1.0, 1.0}) {
    MeasuredMotion motion(0.01, 1e-6, 1e-9 * static_cast<double>(kPeriod));
    for (int k = 0; k <= MeasuredMotion::kSamples; ++k)
      motion.sample(direction * 0.02 * 1e-9 * static_cast<double>(k * kPeriod), k * kPeriod);
    EXPECT_TRUE(motion.tooFast()) << direction;
  }
}

TEST(Brakes, HoldWhatFallsWheneverTorqueGoes) {
  constexpr FaultKind kKinds[] = {FaultKind::kOverTemperature, FaultKind::kEncoderAlarm, FaultKind::kWrong};
  for (std::uint32_t run = 0; run < 12; ++run) {
    SCOPED_TRACE(tandem::test::trace(tandem::test::baseSeed() + run));
    tandem::test::Random random(tandem::test::baseSeed() + run);
    System system(brakedHardware());
    ASSERT_TRUE(system.boot());
    const double at_start = system.truth(0, 0);
    ASSERT_TRUE(system.enable()) << system.story();
    EXPECT_NEAR(system.truth(0, 0), at_start, 20e-6) << "it fell while the brake opened";
    const TorqueWatch watch(system);
    system.move(0, ArmVector::Constant(6, random.uniform(-1.0, 1.0) * 6e-3));
    system.run(random.uniform(0.3, 0.8));
    const int choice = random.integer(0, 3);
    if (choice == 3) {
      system.request(DriveRequest::kDisable);
    } else {
      // The drive of the axis itself still works: it may keep its torque as long as necessary.
      ASSERT_TRUE(system.inject(0, kKinds[choice], choice == 0 ? 5 : 17, choice == 2 ? 50000.0 : 0.0));
    }
    ASSERT_TRUE(system.until(2.0, [&] { return system.robot->arm(0).power() == ArmPower::kOff; })) << system.story();
    const double stopped = system.truth(0, 0);
    system.run(0.5);
    EXPECT_NEAR(system.truth(0, 0), stopped, 20e-6) << "it fell";
    EXPECT_LE(watch.fastest, kRestShare);
  }
}

TEST(Brakes, AbortedHomingRunLetsNoBrakedJointFall) {
  System system(withHoming(brakedHardware()));
  letGoOfHoming(system);
  const TorqueWatch watch(system);
  const double stopped = system.truth(0, 0);
  system.run(0.5);
  EXPECT_NEAR(system.truth(0, 0), stopped, 20e-6) << "it fell";
  EXPECT_LE(watch.fastest, kRestShare);
}

TEST(Brakes, FailedBrakeIsDetectedBeforeEnabling) {
  System system(brakedHardware());
  ASSERT_TRUE(system.boot());
  ASSERT_TRUE(system.inject(0, FaultKind::kBrakeFailure, 1));
  system.run(0.2);
  system.request(DriveRequest::kEnable);
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->state(0) == OperatingState::kFault; }));
  EXPECT_EQ(system.robot->faultRecord(0).cause, safety::FaultCause::kBrake);
  EXPECT_EQ(system.robot->faultRecord(0).joint, 0);
  EXPECT_EQ(system.robot->arm(0).power(), ArmPower::kOff);
}

TEST(Brakes, DrivesKeepTheirTorqueWhenTheHalDies) {
  System system(brakedHardware());
  ASSERT_TRUE(system.boot() && system.enable());
  system.move(0, ArmVector::Constant(6, 4e-3));
  system.run(0.5);
  system.hal_alive = false;
  system.run(0.5);
  const double stopped = system.truth(0, 0);
  system.run(1.0);
  EXPECT_NEAR(system.truth(0, 0), stopped, 20e-6);
}

/// For any delay of the process, of any length: asserted at its own ticks, by its own clock.
TEST(Budgets, NoTickPassesWithASilenceAboveTheBudgetAndNoLatch) {
  for (std::uint32_t run = 0; run < 20; ++run) {
    SCOPED_TRACE(tandem::test::trace(tandem::test::baseSeed() + run));
    tandem::test::Random random(tandem::test::baseSeed() + run);
    System system;
    ASSERT_TRUE(system.boot() && system.enable());
    const double budget = safety::Budgets{}.commandAge(System::kControlPeriod);
    system.move(0, oneJoint(4e-3));
    std::int64_t received = system.now;
    std::uint64_t taken = system.robot->answersCommand();
    system.after_period = [&] {
      if (system.robot->answersCommand() != taken)
        received = system.now;
      taken = system.robot->answersCommand();
      if (1e-9 * static_cast<double>(system.now - received) > budget) {
        ASSERT_NE(system.robot->state(0), OperatingState::kEnabled) << "a tick too many";
      }
    };
    for (int i = 0; i < 6; ++i) {
      system.commanding = random.chance(0.7);
      system.hal_alive = random.chance(0.7);
      system.run(random.uniform(0.01, 0.6));
    }
    system.hal_alive = true;
    system.commanding = false;
    system.run(budget + 2.0 * system.config.period);
    EXPECT_NE(system.robot->state(0), OperatingState::kEnabled);
  }
}

TEST(Limits, ADriveThatHoldsItsTargetBackStopsTheArm) {
  System system;
  ASSERT_TRUE(system.boot());
  sim::drives::Drive& drive = system.drive(0, kMoving);
  const auto limit = static_cast<std::int64_t>(drive.position() + 1e-3 / std::abs(scaleOf(system, 0, kMoving)));
  drive.dictionary().require(0x607D, 2).value = limit;
  ASSERT_TRUE(system.enable());
  system.move(0, oneJoint(scaleOf(system, 0, kMoving) > 0.0 ? 4e-3 : -4e-3));
  ASSERT_TRUE(system.until(0.6, [&] { return system.robot->state(0) == OperatingState::kFault; })) << system.story();
  EXPECT_EQ(system.robot->faultRecord(0).cause, safety::FaultCause::kOutsideLimits);
  EXPECT_EQ(system.robot->faultRecord(0).joint, kMoving);
}

}  // namespace
}  // namespace tandem::hal::test
