// SPDX-License-Identifier: Apache-2.0
/** @file Joints whose position somebody measures from outside after each start. */
#include "robot_fixture.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::hal::test {
namespace {

using tandem::test::Random;

/// The linear stages of arm A have no encoder; their drives count from 0 at each start.
HardwareConfig measuredHardware() {
  HardwareConfig config = presetHardware();
  for (AxisConfig& axis : config.axes) {
    if (axis.arm != 0 || !axis.translation)
      continue;
    axis.reference = PositionReference::kMeasured;
    axis.encoder.reset();
    axis.first_motion = kFirstTranslation;
  }
  return config;
}

/** The joints stand at the middle of their limits, and a gauge can tell where they are. */
class Measured : public System {
 public:
  explicit Measured(const HardwareConfig& hardware = measuredHardware()) : System(hardware) {
    robot->start(now);
    run(3.0);
    for (int j = 0; j < 3; ++j)
      start_.push_back(gauge(j));
  }
  /// Position of a carriage, m: its motor, from a place that nobody but the test knows.
  double gauge(int joint) { return middle(joint) + scale(joint) * drive(0, joint).motor().position(); }
  double moved(int joint) { return gauge(joint) - start_[static_cast<std::size_t>(joint)]; }
  double scale(int joint) const { return AxisUnits(axis(joint).gearing).scale(); }
  MeasurementAnswer measure(int joint) { return robot->takeMeasurement(0, joint, gauge(joint)); }
  bool measureAll() {
    for (int j = 0; j < 3; ++j) {
      if (measure(j) != MeasurementAnswer::kTaken)
        return false;
    }
    return until(2.0, [this] { return allHomed(); });
  }
  AxisPhase phase(int joint) const { return robot->arm(0).axis(joint).phase(); }

 private:
  const AxisConfig& axis(int joint) const { return config.axes[static_cast<std::size_t>(joint)]; }
  double middle(int joint) const { return 0.5 * (axis(joint).lower + axis(joint).upper); }

  std::vector<double> start_;
};

TEST(MeasuredPosition, IsReportedAndRequiredBeforeEnabling) {
  Measured system;
  for (int j = 0; j < 3; ++j)
    EXPECT_EQ(system.phase(j), AxisPhase::kUnmeasured);
  EXPECT_EQ(system.phase(3), AxisPhase::kReady);
  EXPECT_EQ(std::ranges::count(system.events, HardwareEvent::Kind::kUnmeasured, &HardwareEvent::kind), 3);
  EXPECT_EQ(system.robot->home(0, system.now), ArmHardware::HomingAnswer::kUnmeasured) << "there is no run for it";
  EXPECT_FALSE(system.enable());
  EXPECT_EQ(system.robot->arm(0).power(), ArmPower::kOff);
  system.request(DriveRequest::kDisable);
  system.run(0.5);
  const std::uint32_t resets = system.robot->jointResets();
  ASSERT_EQ(system.measure(0), MeasurementAnswer::kTaken);
  ASSERT_TRUE(system.until(2.0, [&] { return system.phase(0) == AxisPhase::kReady; })) << system.story();
  EXPECT_EQ(system.robot->jointResets(), resets + 1) << "control takes the new position without a motion";
  EXPECT_FALSE(system.robot->homed(0)) << "two are missing";
  ASSERT_TRUE(system.measureAll()) << system.story();
  ASSERT_TRUE(system.enable()) << system.story();
  for (int j = 0; j < 3; ++j) {
    EXPECT_NEAR(system.robot->position(0)[j], system.gauge(j), 2.0 * system.scale(j));
    EXPECT_NEAR(system.moved(j), 0.0, 2.0 * system.scale(j)) << "nothing has moved";
  }
}

TEST(MeasuredPosition, IsWhereTheJointIsWhereverItStands) {
  for (std::uint32_t seed = tandem::test::baseSeed(); seed < tandem::test::baseSeed() + 8; ++seed) {
    SCOPED_TRACE(tandem::test::trace(seed));
    Random random(seed);
    Measured system;
    const double way = random.uniform(-2e-3, 2e-3);
    for (int j = 0; j < 3; ++j)
      system.drive(0, j).motor().turn(way / system.scale(j));
    system.run(0.5);
    ASSERT_TRUE(system.measureAll()) << system.story();
    ASSERT_TRUE(system.enable()) << system.story();
    system.move(0, speeds(random.chance(0.5) ? 1e-3 : -1e-3, 0.0));
    system.run(1.0);
    system.hold();
    system.run(0.5);
    EXPECT_EQ(system.robot->state(0), OperatingState::kEnabled) << system.story();
    for (int j = 0; j < 3; ++j) {
      EXPECT_GT(std::abs(system.moved(j) - way), 0.9e-3);
      EXPECT_NEAR(system.robot->position(0)[j], system.gauge(j), 0.1e-3);
    }
  }
}

TEST(MeasuredPosition, IsRefusedWhereItCannotBeTaken) {
  Measured system;
  EXPECT_EQ(system.robot->takeMeasurement(0, 3, 0.0), MeasurementAnswer::kOtherReference);
  const AxisConfig& axis = system.config.axes[0];
  const double range = axis.upper - axis.lower, infinity = std::numeric_limits<double>::infinity();
  for (const double absurd : {axis.upper + 1.01 * range, axis.lower - 1.01 * range, 1e300, -infinity, infinity,
                              std::numeric_limits<double>::quiet_NaN()})
    EXPECT_EQ(system.robot->takeMeasurement(0, 0, absurd), MeasurementAnswer::kOutside) << absurd;
  EXPECT_EQ(system.phase(0), AxisPhase::kUnmeasured);
  // A joint that moves is not where it was measured: here at 5 mm/s, without torque.
  for (int i = 0; i < 50; ++i) {
    system.drive(0, 0).motor().turn(20e-6 / system.scale(0));
    system.run(0.004);
    if (i > 20) {
      EXPECT_EQ(system.measure(0), MeasurementAnswer::kMoves);
    }
  }
  EXPECT_EQ(system.robot->arm(0).axis(0).guards(), 0u);
  system.run(1.0);
  ASSERT_TRUE(system.measureAll()) << system.story();
  ASSERT_TRUE(system.enable()) << system.story();
  EXPECT_EQ(system.measure(0), MeasurementAnswer::kNotDisabled) << "the arm has power";
  EXPECT_EQ(system.phase(0), AxisPhase::kReady);
  const int node = axis.node;
  ASSERT_TRUE(system.inject(0, FaultKind::kOff, node, 0.0, 0.5));
  system.run(1.0);
  EXPECT_EQ(system.measure(0), MeasurementAnswer::kNotDisabled);
}

TEST(MeasuredPosition, OfADriveThatIsNotReadyIsRefusedWithItsReason) {
  Measured system;
  ASSERT_TRUE(system.inject(0, FaultKind::kEncoderAlarm, system.config.axes[0].node));
  system.run(0.1);
  EXPECT_EQ(system.robot->state(0), OperatingState::kDisabled);
  EXPECT_EQ(system.measure(0), MeasurementAnswer::kGuarded) << system.story();
  ASSERT_TRUE(system.measure(1) == MeasurementAnswer::kTaken) << "of another joint: " << system.story();
  system.robot->start(system.now);
  EXPECT_EQ(system.measure(0), MeasurementAnswer::kNotUp) << "it boots";
}

TEST(MeasuredPosition, EndsWithTheDrivesAndAMistakeCanBeCorrected) {
  Measured system;
  ASSERT_EQ(system.robot->takeMeasurement(0, 0, system.gauge(0) + 1e-3), MeasurementAnswer::kTaken);
  system.run(0.5);
  EXPECT_EQ(system.phase(0), AxisPhase::kReady);
  ASSERT_TRUE(system.measureAll()) << "a later one replaces it; " << system.story();
  EXPECT_NEAR(system.robot->position(0)[0], system.gauge(0), 2.0 * system.scale(0));
  ASSERT_TRUE(system.enable()) << system.story();
  ASSERT_TRUE(system.inject(0, FaultKind::kOff, system.config.axes[0].node, 0.0, 0.5));
  system.run(1.0);
  EXPECT_EQ(system.robot->state(0), OperatingState::kFault);
  system.request(DriveRequest::kDisable);
  system.run(10.0);
  EXPECT_EQ(system.phase(0), AxisPhase::kUnmeasured) << "its drive counts from 0 again: " << system.story();
  EXPECT_FALSE(system.enable());
}

TEST(MeasuredPosition, IsComparedWithTheLastOne) {
  HardwareConfig hardware = measuredHardware();
  hardware.axes[0].jump_tolerance = 0.5e-3;
  Measured system(hardware);
  system.robot->restorePosition(0, LastPosition::kKnown, system.gauge(0) - 0.4e-3);
  ASSERT_TRUE(system.measureAll()) << system.story();
  system.robot->restorePosition(0, LastPosition::kKnown, system.gauge(0) - 0.6e-3);
  ASSERT_FALSE(system.measureAll());
  EXPECT_TRUE(system.robot->arm(0).axis(0).unconfirmed());
  for (double t = 0.0; t < 4.0; t += 0.2) {
    system.robot->home(0, system.now);
    system.run(0.2);
  }
  EXPECT_TRUE(system.allHomed()) << "somebody insists";
}

}  // namespace
}  // namespace tandem::hal::test
