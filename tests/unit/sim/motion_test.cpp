// SPDX-License-Identifier: Apache-2.0
/** @file Response of the simulated drives to commands, in real time and in lock-step. */
#include <stdexcept>

#include "tests/unit/safety/allocation_counter.h"
#include "tests/unit/sim/drives_fixture.h"

namespace tandem::test {
namespace {

class Motion : public DrivesFixture {};

class LockStep : public DrivesFixture {
 protected:
  LockStep() : DrivesFixture(true) {}
  void advance() {
    now += static_cast<std::int64_t>(kPeriod * 1e9);
    drives.advance(now);
  }
};

TEST_F(Motion, ReachesEachSetpointExactlyAfterOnePeriodOnAStraightLine) {
  request(DriveRequest::kEnable);
  for (int i = 0; i < 50; ++i) {
    const ArmVector from = drives.plant(0).position();
    ArmVector speed = fullSpeed();
    if (i % 3 == 1)
      speed = -speed;
    const sim::Command command = moveCommand(speed);
    ASSERT_TRUE(drives.command(command, now));
    run(0.5 * kPeriod);
    EXPECT_LE((drives.plant(0).position() - (from + 0.5 * kPeriod * speed)).norm(), 1e-12);
    run(0.5 * kPeriod);
    for (int j = 0; j < 4; ++j)
      EXPECT_EQ(drives.plant(0).position()[j], command.position[j]);
    EXPECT_LE((drives.velocity(0) - speed).norm(), 1e-9);
  }
  EXPECT_EQ(drives.guards()[safety::Guard::kVelocity].count, 0u);
}

TEST_F(Motion, ACommanderThatIsWrongAboutTheSetpointCausesNoJump) {
  request(DriveRequest::kEnable);
  for (int i = 0; i < 20; ++i) {
    const ArmVector from = drives.setpoint(0);
    sim::Command command = moveCommand(0.5 * fullSpeed());
    for (double& position : command.position)
      position += i % 2 == 0 ? 0.01 : -0.02;
    ASSERT_TRUE(drives.command(command, now));
    EXPECT_LE((drives.setpoint(0) - from - 0.5 * kPeriod * fullSpeed()).norm(), 1e-12);
    run(kPeriod);
  }
  for (int g = 0; g < safety::kGuardCount; ++g)
    EXPECT_EQ(drives.guards()[static_cast<safety::Guard>(g)].count, 0u);
}

TEST_F(Motion, EnablingNeverJumps) {
  const ArmVector before = drives.plant(0).position();
  sim::Command command = moveCommand(fullSpeed());
  command.request.fill(DriveRequest::kEnable);
  command.position.fill(-0.05);
  EXPECT_TRUE(drives.command(command, now));
  EXPECT_EQ(drives.state(0), OperatingState::kEnabled);
  EXPECT_EQ(drives.setpoint(0), before);
  run(kPeriod);
  EXPECT_EQ(drives.plant(0).position(), before);
  EXPECT_EQ(drives.state(0), OperatingState::kEnabled);
}

TEST_F(Motion, EarlyCommandsAreNotFasterThanTheJointsMayBe) {
  request(DriveRequest::kEnable);
  ArmVector last = drives.plant(0).position();
  for (int i = 0; i < 200; ++i) {
    if (i % 5 == 0)
      move(fullSpeed());  // twenty times as often as configured
    tick();
    const ArmVector q = drives.plant(0).position();
    for (int j = 0; j < 4; ++j) {
      ASSERT_LE(std::abs(q[j] - last[j]) / kTick, fixtureLimits().joints[j].velocity * (1 + 1e-5));
    }
    last = q;
  }
}

TEST_F(Motion, ALateCommandContinuesTheMotionFromTheRamp) {
  bringToSpeed();
  run(0.5 * kPeriod + 0.02);  // 20 ms late
  EXPECT_EQ(drives.state(0), OperatingState::kEnabled);
  const double slowed = drives.plant(0).velocity()[0];
  EXPECT_NEAR(slowed, -kSpeed * (1.0 - 0.02 / kStopTime), 2e-4);
  move(fullSpeed());
  tick();
  EXPECT_NEAR(drives.plant(0).velocity()[0], -kSpeed, 1e-6);
}

TEST_F(Motion, ResetNeedsAStandingDisabledRobotAndJointsInside) {
  safety::RobotVector q(8);
  q << -0.2, -0.1, 0, 0, -0.1, -0.05, 0, 0;
  bringToSpeed();
  EXPECT_EQ(drives.reset(q), sim::ResetResult::kEnabled);
  request(DriveRequest::kDisable);
  EXPECT_EQ(drives.reset(q), sim::ResetResult::kMoving);
  timeToStand(kStopTime);
  EXPECT_EQ(drives.reset(q.head(6)), sim::ResetResult::kWrongSize);
  safety::RobotVector outside = q;
  outside[1] = -0.3;
  EXPECT_EQ(drives.reset(outside), sim::ResetResult::kOutsideLimits);
  EXPECT_EQ(drives.reset(q), sim::ResetResult::kDone);
  EXPECT_EQ(drives.position(1), q.tail(4));
  EXPECT_EQ(drives.setpoint(0), q.head(4));
  run(0.1);
  EXPECT_EQ(drives.position(1), q.tail(4));
}

TEST_F(Motion, InjectRefusesAxesThatAreNotThere) {
  EXPECT_TRUE(drives.inject(1, 3, sim::AxisFault::kStuck));
  EXPECT_FALSE(drives.inject(2, 0, sim::AxisFault::kStuck));
  EXPECT_FALSE(drives.inject(0, 4, sim::AxisFault::kStuck));
  EXPECT_FALSE(drives.inject(-1, 0, sim::AxisFault::kStuck));
}

TEST(SimulatedDrivesArguments, AreCheckedByTheConstructor) {
  const auto make = [](const std::vector<ArmLimits>& limits, const std::vector<ArmVector>& start, double period) {
    sim::SimulatedDrivesOptions options;
    options.control_period = period;
    sim::SimulatedDrives drives(limits, start, options);
  };
  EXPECT_NO_THROW(make({fixtureLimits()}, {fixtureStart()}, 0.1));
  EXPECT_THROW(make({}, {}, 0.1), std::invalid_argument);
  EXPECT_THROW(make({fixtureLimits()}, {}, 0.1), std::invalid_argument);
  EXPECT_THROW(make({fixtureLimits()}, {ArmVector::Zero(4)}, 0.1), std::invalid_argument);
  EXPECT_THROW(make({fixtureLimits()}, {ArmVector::Zero(6)}, 0.1), std::invalid_argument);
  EXPECT_THROW(make({fixtureLimits()}, {fixtureStart()}, 0.0), std::invalid_argument);
}

TEST_F(LockStep, JointsAreAtTheirSetpointsBitForBitAndHoldThere) {
  request(DriveRequest::kEnable);
  for (int i = 0; i < 100; ++i) {
    const sim::Command command = moveCommand(0.9 * fullSpeed());
    ASSERT_TRUE(drives.command(command, now));
    advance();
    for (int j = 0; j < 4; ++j)
      ASSERT_EQ(drives.position(1)[j], command.position[safety::kMaxJointsPerArm + j]);
  }
  const ArmVector before = drives.position(1);
  for (int i = 0; i < 100; ++i) {
    drives.command(nextCommand(), now);
    advance();
    ASSERT_EQ(drives.position(1), before);
  }
  EXPECT_TRUE(drives.standing());
  EXPECT_EQ(drives.state(0), OperatingState::kEnabled);
  request(DriveRequest::kDisable);
  safety::RobotVector q(8);
  q << fixtureStart(), fixtureStart();
  EXPECT_EQ(drives.reset(q), sim::ResetResult::kDone);
}

TEST_F(LockStep, StopsWithTheRampAndLatches) {
  request(DriveRequest::kEnable);
  move(fullSpeed());
  advance();
  drives.stop();
  advance();
  advance();
  EXPECT_TRUE(drives.standing());
  expectFault(safety::bit(Fault::kStopRequested));
}

TEST_F(Motion, CommandAndStepDoNotAllocate) {
  if (!canCountAllocations())
    GTEST_SKIP() << "the sanitizer has its own allocator";
  bringToSpeed();
  const std::size_t before = allocationCount();
  for (int i = 0; i < 20; ++i) {
    move(fullSpeed());
    run(kPeriod);
  }
  drives.inject(0, 0, sim::AxisFault::kStuck);
  move(fullSpeed());
  run(kPeriod);
  drives.stop();
  run(kPeriod);
  request(DriveRequest::kDisable);
  EXPECT_EQ(allocationCount(), before);
  // Verifies the counter, without which this test could not fail.
  const std::vector<double> proof(1000, 1.0);
  EXPECT_GT(allocationCount(), before);
  EXPECT_EQ(proof.size(), 1000u);
}

}  // namespace
}  // namespace tandem::test
