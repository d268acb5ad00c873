// SPDX-License-Identifier: Apache-2.0
/** @file Each stop cause: stop within its budget, latched faults, clearing. */
#include <functional>

#include "tests/unit/sim/drives_fixture.h"

namespace tandem::test {
namespace {

using safety::bit;
using safety::Guard;

class Stop : public DrivesFixture {
 protected:
  /// After a stop: latched except for `disable`, and at standstill until enabled again.
  void expectLatchedAndClearedOnlyByDisable(safety::FaultMask faults) {
    expectFault(faults);
    for (const DriveRequest what : {DriveRequest::kEnable, DriveRequest::kPause, DriveRequest::kResume}) {
      request(what);
      expectFault(faults);
    }
    expectNothingMoves();
    request(DriveRequest::kDisable);
    for (int arm = 0; arm < 2; ++arm) {
      EXPECT_EQ(drives.state(arm), OperatingState::kDisabled);
      EXPECT_EQ(drives.faults(arm), 0u);
    }
    expectNothingMoves();
    request(DriveRequest::kEnable);
    EXPECT_EQ(drives.state(0), OperatingState::kEnabled);
    const ArmVector before = drives.plant(0).position();
    move(fullSpeed());
    run(kPeriod);
    EXPECT_NE(drives.plant(0).position(), before);
  }
};

TEST_F(Stop, SilenceStopsAtTheEndOfTheSegmentAndLatchesAfterTheBudget) {
  bringToSpeed();
  const std::int64_t last_command = now - 50'000'000;
  // Half a segment remains, then the ramp.
  const double time = timeToStand(0.5 * kPeriod + kStopTime);
  EXPECT_GT(time, 0.5 * kPeriod);
  EXPECT_EQ(drives.state(0), OperatingState::kEnabled);
  const double budget = safety::Budgets{}.commandAge(kPeriod);
  while (drives.state(0) == OperatingState::kEnabled && now - last_command < 1'000'000'000)
    tick();
  EXPECT_NEAR(1e-9 * static_cast<double>(now - last_command), budget, 1.5 * kTick);
  expectLatchedAndClearedOnlyByDisable(bit(Fault::kCommandTimeout));
}

TEST_F(Stop, StopTopicStopsWithinTheRampInEveryState) {
  const std::function<void()> states[] = {[&] { bringToSpeed(); },
                                          [&] {
                                            bringToSpeed();
                                            request(DriveRequest::kPause);
                                          },
                                          [&] {
                                            bringToSpeed();
                                            request(DriveRequest::kPause);
                                            timeToStand(kStopTime);
                                            EXPECT_EQ(drives.state(0), OperatingState::kPaused);
                                          },
                                          [&] {
                                            request(DriveRequest::kDisable);
                                            timeToStand(kStopTime);
                                            EXPECT_EQ(drives.state(0), OperatingState::kDisabled);
                                          }};
  for (const auto& enter : states) {
    enter();
    drives.stop();
    timeToStand(kStopTime);
    expectLatchedAndClearedOnlyByDisable(bit(Fault::kStopRequested));
  }
}

TEST_F(Stop, ACommandForAnotherRobotStopsArmsThatHavePower) {
  drives.stopPowered({bit(Fault::kMismatch)});
  EXPECT_EQ(drives.state(0), OperatingState::kDisabled) << "nothing to stop";
  bringToSpeed();
  drives.stopPowered({bit(Fault::kMismatch)});
  timeToStand(kStopTime);
  expectLatchedAndClearedOnlyByDisable(bit(Fault::kMismatch));
}

TEST_F(Stop, TheEmergencyStopStopsLatchesAndIsClearedOnlyWhenReleased) {
  bringToSpeed();
  drives.setEmergencyStop(true);
  timeToStand(kStopTime + kTick);
  expectFault(bit(Fault::kStopRequested));
  EXPECT_EQ(drives.faultRecord(0).cause, safety::FaultCause::kEmergencyStop);
  EXPECT_EQ(drives.emergencyStop(), safety::EmergencyStop::kPressed);
  request(DriveRequest::kDisable);
  request(DriveRequest::kEnable);
  expectFault(bit(Fault::kStopRequested));
  EXPECT_EQ(drives.faultRecord(0).cause, safety::FaultCause::kEmergencyStop);
  drives.setEmergencyStop(false);
  run(kTick);
  expectFault(bit(Fault::kStopRequested));
  request(DriveRequest::kDisable);
  EXPECT_EQ(drives.state(0), OperatingState::kDisabled);
  request(DriveRequest::kEnable);
  EXPECT_EQ(drives.state(0), OperatingState::kEnabled);
}

TEST_F(Stop, BadStreamStopsAllArms) {
  struct Case {
    const char* name;
    void (*spoil)(sim::Command&);
    Fault fault;
    Guard guard;
  };
  const Case cases[] = {
      {"stale", [](sim::Command& c) { c.header.age = 0.301; }, Fault::kStaleCommand, Guard::kFresh},
      {"repeated", [](sim::Command& c) { --c.header.sequence; }, Fault::kOutOfSequence, Guard::kSequence},
      {"foreign", [](sim::Command& c) { c.header.session = 666; }, Fault::kOutOfSequence, Guard::kSequence},
      {"one arm", [](sim::Command& c) { c.header.arm_count = 1; }, Fault::kUnknownArm, Guard::kKnownArm},
  };
  for (const Case& each : cases) {
    SCOPED_TRACE(each.name);
    bringToSpeed();
    const std::uint64_t count = drives.guards()[each.guard].count;
    sim::Command command = moveCommand(fullSpeed());
    each.spoil(command);
    EXPECT_FALSE(drives.command(command, now));
    EXPECT_EQ(drives.guards()[each.guard].count, count + 2);
    timeToStand(kStopTime);
    expectLatchedAndClearedOnlyByDisable(bit(each.fault));
    request(DriveRequest::kDisable);
    timeToStand(kStopTime);
  }
}

TEST_F(Stop, BadMotionStopsTheArmItIsFor) {
  struct Case {
    const char* name;
    std::array<double, safety::kMaxJoints> sim::Command::*numbers;
    int element;
    double value;
    Fault fault;
    Guard guard;
  };
  const Case cases[] = {
      {"position", &sim::Command::position, 2, std::nan(""), Fault::kNotFinite, Guard::kFinite},
      {"infinite position", &sim::Command::position, 0, safety::kUnlimited, Fault::kNotFinite, Guard::kFinite},
      {"velocity", &sim::Command::velocity, 3, std::nan(""), Fault::kNotFinite, Guard::kFinite},
      {"step", &sim::Command::velocity, 1, 0.6, Fault::kStepTooLarge, Guard::kStep}};
  for (const Case& each : cases) {
    SCOPED_TRACE(each.name);
    bringToSpeed();
    sim::Command command = moveCommand(fullSpeed());
    (command.*
     each.numbers)[static_cast<std::size_t>(safety::kMaxJointsPerArm) + static_cast<std::size_t>(each.element)] =
        each.value;
    EXPECT_TRUE(drives.command(command, now));
    EXPECT_EQ(drives.state(0), OperatingState::kEnabled);
    EXPECT_EQ(drives.faults(1), bit(each.fault));
    EXPECT_EQ(drives.guards()[each.guard].arm, 1);
    EXPECT_EQ(drives.faultRecord(1).faults, bit(each.fault));
    EXPECT_EQ(drives.faultRecord(1).joint, each.element);
    run(kStopTime + 2 * kTick);
    EXPECT_TRUE(drives.standing(1));
    EXPECT_FALSE(drives.standing(0)) << "the other arm goes on";
    request(DriveRequest::kDisable);
    timeToStand(kStopTime);
  }
}

TEST_F(Stop, AxisFailuresStopTheWholeArm) {
  struct Case {
    sim::AxisFault axis;
    Fault fault;
    bool stands;  ///< the cause persists until it is removed
  };
  for (const Case& each :
       {Case{sim::AxisFault::kOff, Fault::kDrive, true}, Case{sim::AxisFault::kStuck, Fault::kDrive, false},
        Case{sim::AxisFault::kGarbage, Fault::kSensor, true}, Case{sim::AxisFault::kInvalid, Fault::kSensor, true}}) {
    SCOPED_TRACE(sim::name(each.axis));
    bringToSpeed();
    ASSERT_TRUE(drives.inject(1, 0, each.axis));
    // A stuck axis is detected when it lags by the following error: 0.5 mm at 10 mm/s.
    const double detection = each.axis == sim::AxisFault::kStuck ? 0.05 : 0.0;
    run(detection + kStopTime + 3 * kTick);
    EXPECT_TRUE(drives.standing(1));
    EXPECT_EQ(drives.faults(1), bit(each.fault));
    EXPECT_EQ(drives.faultRecord(1).joint, 0);
    EXPECT_EQ(drives.faultRecord(0).faults, 0u);
    if (each.axis == sim::AxisFault::kStuck) {
      EXPECT_EQ(drives.faultRecord(1).cause, safety::FaultCause::kFollowingError);
      EXPECT_EQ(drives.faultRecord(1).allowed, 0.5e-3);
      EXPECT_GT(drives.faultRecord(1).amount, 0.5e-3);
      EXPECT_LE(drives.faultRecord(1).amount, 0.5e-3 + kSpeed * kTick * 1.01);
    }
    EXPECT_EQ(drives.valid(1), each.fault != Fault::kSensor);
    EXPECT_LE(safety::largestViolation(fixtureLimits(), drives.plant(1).position()), 1e-9);
    request(DriveRequest::kDisable);
    EXPECT_EQ(drives.state(1) == OperatingState::kFault, each.stands);
    drives.inject(1, 0, sim::AxisFault::kNone);
    request(DriveRequest::kDisable);
    EXPECT_EQ(drives.state(1), OperatingState::kDisabled);
    EXPECT_EQ(drives.faultRecord(1).faults, 0u);
    timeToStand(kStopTime);
    const ArmVector before = drives.plant(1).position();
    run(0.1);
    EXPECT_EQ(drives.plant(1).position(), before) << "an axis that recovers does not move by itself";
  }
}

TEST_F(Stop, EnablingWithAStandingCauseSaysWhy) {
  drives.inject(0, 3, sim::AxisFault::kOff);
  request(DriveRequest::kEnable);
  EXPECT_EQ(drives.state(0), OperatingState::kFault);
  EXPECT_EQ(drives.faults(0), bit(Fault::kDrive));
  EXPECT_EQ(drives.state(1), OperatingState::kEnabled);
}

TEST_F(Stop, PauseAndDisableStopWithinTheRampAndResumeWaitsForAFreshCommand) {
  bringToSpeed();
  request(DriveRequest::kPause);
  EXPECT_EQ(drives.state(0), OperatingState::kPaused);
  timeToStand(kStopTime);
  expectNothingMoves();
  run(1.0);
  EXPECT_EQ(drives.state(0), OperatingState::kPaused) << "a paused arm may wait without commands";
  sim::Command command = moveCommand(fullSpeed());
  command.request.fill(DriveRequest::kResume);
  drives.command(command, now);
  EXPECT_EQ(drives.state(0), OperatingState::kEnabled);
  const ArmVector before = drives.plant(0).position();
  run(0.05);
  EXPECT_EQ(drives.plant(0).position(), before) << "motion that was computed while paused does not count";
  move(fullSpeed());
  run(0.05);
  EXPECT_NE(drives.plant(0).position(), before);
  request(DriveRequest::kDisable);
  EXPECT_EQ(drives.state(0), OperatingState::kDisabled);
  timeToStand(kStopTime);
  expectNothingMoves();
}

TEST_F(Stop, AHoldEndsTheSegmentStopsWithinTheRampAndHolds) {
  bringToSpeed();
  const ArmVector promised = drives.setpoint(0);
  drives.command(nextCommand(), now);
  run(0.5 * kPeriod);
  EXPECT_EQ(drives.plant(0).position(), promised);
  timeToStand(kStopTime);
  const ArmVector before = drives.plant(0).position();
  for (int i = 0; i < 20; ++i) {
    drives.command(nextCommand(), now);
    run(kPeriod);
  }
  EXPECT_EQ(drives.plant(0).position(), before);
  EXPECT_EQ(drives.state(0), OperatingState::kEnabled);
}

TEST_F(Stop, NothingMovesOnReconnect) {
  bringToSpeed();
  timeToStand(kPeriod + kStopTime);
  // Another command source appears before the budget has passed; the arms are still ENABLED by the first one.
  ASSERT_EQ(drives.state(0), OperatingState::kEnabled);
  session = 43;
  sequence = 0;
  EXPECT_TRUE(drives.command(nextCommand(), now));
  EXPECT_EQ(drives.state(0), OperatingState::kDisabled);
  expectNothingMoves();
  // The first one resumes: it has lost the arms, too.
  session = 42;
  sequence = 1000;
  expectNothingMoves();
  request(DriveRequest::kEnable);
  EXPECT_EQ(drives.state(0), OperatingState::kEnabled);
  // A foreign session while the arms move is a fault, not a takeover.
  move(fullSpeed());
  run(0.05);
  sim::Command foreign = nextCommand();
  foreign.header.session = 43;
  EXPECT_FALSE(drives.command(foreign, now));
  expectFault(bit(Fault::kOutOfSequence));
}

}  // namespace
}  // namespace tandem::test
