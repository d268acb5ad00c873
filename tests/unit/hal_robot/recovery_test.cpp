// SPDX-License-Identifier: Apache-2.0
/** @file Recovery and withdrawal of arms outside their limits or with lost joints, over simulated drives. */
#include "safety/recovery.h"

#include "tests/unit/hal_robot/robot_fixture.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::hal::test {
namespace {

using safety::jointBit;
using safety::JointMask;

constexpr double kOutside = 0.9e-3;  ///< m

/// Joint 1 of the first arm starts outside the limits of its drive.
HardwareConfig outsideHardware(double start) {
  HardwareConfig config = presetHardware();
  config.axes[0].upper = start - kOutside;
  config.arms[0].limits.joints[0].upper = start - kOutside;
  return config;
}

ArmVector oneJoint(int joint, double speed) {
  ArmVector v = ArmVector::Zero(6);
  v[joint] = speed;
  return v;
}

double startOfFirst() {
  System system;
  EXPECT_TRUE(system.boot());
  return system.robot->position(0)[0];
}

TEST(OutsideItsLimits, AnArmIsRefusedByHowMuchAndRecoveredInwards) {
  System system(outsideHardware(startOfFirst()));
  ASSERT_TRUE(system.boot()) << system.story();
  const double start = system.truth(0, 0);
  system.command.request[0] = DriveRequest::kEnable;
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->state(0) == OperatingState::kFault; }));
  EXPECT_EQ(system.robot->faultRecord(0).cause, safety::FaultCause::kOutsideLimits);
  EXPECT_NEAR(system.robot->faultRecord(0).amount, kOutside, 5e-6);
  EXPECT_EQ(system.robot->arm(0).power(), ArmPower::kOff) << "torque would find a distance to cover";
  EXPECT_NEAR(system.truth(0, 0), start, 1e-6);

  system.command.request[0] = DriveRequest::kDisable;
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->state(0) == OperatingState::kDisabled; }));
  system.command.request[0] = DriveRequest::kRecover;
  ASSERT_TRUE(system.until(3.0, [&] { return system.robot->recovering(0); })) << system.story();
  system.command.request[0] = DriveRequest::kKeep;
  EXPECT_NEAR(system.truth(0, 0), start, 2e-6) << "it jumped when torque came";
  system.move(0, oneJoint(0, 5e-3));  // outwards
  system.run(0.5);
  EXPECT_NEAR(system.truth(0, 0), start, 2e-6);
  double fastest = 0.0;
  system.after_period = [&] { fastest = std::max(fastest, std::abs(system.robot->velocity(0)[0])); };
  system.move(0, oneJoint(0, -5e-3));
  system.run(1.0);
  EXPECT_LE(fastest, 1.25 * safety::kRecoveryTranslation);
  EXPECT_LT(system.truth(0, 0), start - kOutside) << "inside again";
  ASSERT_EQ(system.robot->state(0), OperatingState::kEnabled) << system.story();

  system.hold();
  system.command.request[0] = DriveRequest::kDisable;
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->arm(0).power() == ArmPower::kOff; }));
  system.command.request[0] = DriveRequest::kEnable;
  ASSERT_TRUE(system.until(3.0, [&] { return system.robot->state(0) == OperatingState::kEnabled; })) << system.story();
  EXPECT_FALSE(system.robot->recovering(0));
}

/// Both arms' translations are on the first bus, their rotations on the second one.
HardwareConfig sharedBuses() {
  HardwareConfig config = presetHardware();
  for (AxisConfig& axis : config.axes) {
    axis.bus = axis.translation ? 0 : 1;
    axis.node = 3 * axis.arm + axis.joint % 3 + 1;
    axis.encoder->node = 16 + axis.node;
  }
  return config;
}

/** Withdraws an arm with its remaining joints, and checks the final position, the limits and the speed. */
void withdraw(System& system, int arm, JointMask expected_lost) {
  const auto k = static_cast<std::size_t>(arm);
  const safety::ArmLimits& limits = system.config.arms[k].limits;
  system.move(arm, ArmVector::Zero(0));
  system.command.request[k] = DriveRequest::kRecover;
  ASSERT_TRUE(system.until(5.0, [&] { return system.robot->recovering(arm); })) << system.story();
  system.command.request[k] = DriveRequest::kKeep;
  EXPECT_EQ(system.robot->lost(arm), expected_lost);
  const ArmVector start = system.truth(arm);
  double violation = -1.0, fastest = 0.0;
  ArmVector before = start;
  system.after_period = [&] {
    const ArmVector now = system.truth(arm);
    violation = std::max(violation, safety::largestViolation(limits, now));
    fastest = std::max(fastest, (now - before).head(3).cwiseAbs().maxCoeff() / system.config.period);
    before = now;
  };
  int steps = 0;
  for (; steps < 10'000; ++steps) {
    const safety::Withdrawal next = safety::nextWithdrawal(limits, system.robot->setpoint(arm), expected_lost,
                                                           System::kControlPeriod * safety::kRecoveryTranslation);
    if (next.joints == 0)
      break;
    ArmVector v = ArmVector::Zero(6);
    for (int j = 0; j < 3; ++j)
      v[j] = (next.joints & jointBit(j)) != 0 ? -next.distance / System::kControlPeriod : 0.0;
    system.move(arm, v);
    system.run(System::kControlPeriod);
    ASSERT_TRUE(system.robot->recovering(arm)) << system.story();
  }
  system.move(arm, ArmVector::Zero(0));
  system.run(0.3);
  system.after_period = nullptr;
  const ArmVector end = system.truth(arm);
  EXPECT_LE(violation, 0.2e-3) << "joints lag behind what they are reported";
  EXPECT_LE(fastest, 2.0 * safety::kRecoveryTranslation);
  for (int j = 0; j < 6; ++j) {
    if (j >= 3 || (expected_lost & jointBit(j)) != 0)
      EXPECT_NEAR(end[j], start[j], 1e-4) << "joint " << j;
    else
      EXPECT_LE(end[j], start[j] + 1e-4);
  }
  EXPECT_EQ(safety::nextWithdrawal(limits, system.robot->setpoint(arm), expected_lost, 1e-3).joints, 0) << steps;
  const JointMask translations = jointBit(0) | jointBit(1) | jointBit(2);
  if ((expected_lost & translations) == 0) {
    EXPECT_NEAR(end[0], limits.joints[0].lower, 1e-3) << "all the way out";
  }
}

class LossOfOneAxis : public testing::TestWithParam<int> {};

TEST_P(LossOfOneAxis, LeavesAnArmThatWithdrawsWhileTheOtherGoesOn) {
  System system;
  ASSERT_TRUE(system.boot() && system.enable()) << system.story();
  system.move(0, ArmVector::Constant(6, 2e-3));
  system.move(1, ArmVector::Constant(6, 1e-3));
  system.run(0.5);
  ASSERT_TRUE(system.inject(0, FaultKind::kOff, GetParam() + 1));
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->state(0) == OperatingState::kFault; }));
  system.move(1, ArmVector::Zero(0));
  ASSERT_TRUE(system.until(2.0, [&] { return system.robot->arm(0).power() == ArmPower::kOff; }));
  withdraw(system, 0, jointBit(GetParam()));
  EXPECT_EQ(system.robot->state(1), OperatingState::kEnabled) << system.story();
  system.command.request[0] = DriveRequest::kDisable;
  EXPECT_TRUE(system.until(2.0, [&] { return system.robot->arm(0).power() == ArmPower::kOff; })) << system.story();
  system.run(0.3);
  EXPECT_EQ(system.robot->state(0), OperatingState::kDisabled) << "disable ends it";
}

INSTANTIATE_TEST_SUITE_P(EachAxis, LossOfOneAxis, testing::Range(0, 6));

TEST(LossOfABus, SharedByBothArmsLeavesWhatTheOtherBusMoves) {
  System system(sharedBuses());
  ASSERT_TRUE(system.boot() && system.enable()) << system.story();
  ASSERT_TRUE(system.inject(1, FaultKind::kOff, 0));
  ASSERT_TRUE(system.until(1.0, [&] { return system.all(OperatingState::kFault); }));
  system.run(1.0);
  const JointMask rotations = jointBit(3) | jointBit(4) | jointBit(5);
  for (const int arm : {0, 1})
    withdraw(system, arm, rotations);
}

TEST(LossOfABus, WithAllTranslationsLeavesNothingToWithdraw) {
  System system(sharedBuses());
  ASSERT_TRUE(system.boot() && system.enable()) << system.story();
  ASSERT_TRUE(system.inject(0, FaultKind::kOff, 0));
  ASSERT_TRUE(system.until(1.0, [&] { return system.all(OperatingState::kFault); }));
  system.run(1.0);
  system.request(DriveRequest::kRecover);
  ASSERT_TRUE(system.until(3.0, [&] { return system.robot->recovering(0); })) << system.story();
  const JointMask translations = jointBit(0) | jointBit(1) | jointBit(2);
  EXPECT_EQ(system.robot->lost(0), translations);
  EXPECT_EQ(safety::nextWithdrawal(system.config.arms[0].limits, system.robot->setpoint(0), translations, 1e-3).joints,
            0);
}

TEST(LossOfABus, WithAllJointsOfAnArmGivesItNoPower) {
  System system;
  ASSERT_TRUE(system.boot() && system.enable()) << system.story();
  ASSERT_TRUE(system.inject(0, FaultKind::kOff, 0));
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->state(0) == OperatingState::kFault; }));
  system.command.request[0] = DriveRequest::kRecover;
  system.run(2.0);
  EXPECT_EQ(system.robot->state(0), OperatingState::kFault);
  EXPECT_EQ(system.robot->state(1), OperatingState::kEnabled);
}

TEST(Recovery, AJointThatFailsWhileAnArmIsRecoveredStopsItAndIsLeftOutNextTime) {
  System system;
  ASSERT_TRUE(system.boot() && system.enable()) << system.story();
  ASSERT_TRUE(system.inject(0, FaultKind::kOff, 1));
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->state(0) == OperatingState::kFault; }));
  system.command.request[0] = DriveRequest::kRecover;
  ASSERT_TRUE(system.until(5.0, [&] { return system.robot->recovering(0); })) << system.story();
  system.command.request[0] = DriveRequest::kKeep;
  system.run(0.2);
  ASSERT_TRUE(system.inject(0, FaultKind::kOverCurrent, 4));
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->state(0) == OperatingState::kFault; }));
  EXPECT_EQ(system.robot->faultRecord(0).joint, 3);
  system.command.request[0] = DriveRequest::kRecover;
  ASSERT_TRUE(system.until(5.0, [&] { return system.robot->recovering(0); })) << system.story();
  EXPECT_EQ(system.robot->lost(0), jointBit(0) | jointBit(3));
}

TEST(Recovery, StopDuringEnableRemainsLatched) {
  System system;
  ASSERT_TRUE(system.boot());
  system.command.request[0] = DriveRequest::kRecover;
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->arm(0).power() == ArmPower::kSwitchingOn; }));
  system.robot->stop();
  system.run(3.0);
  EXPECT_EQ(system.robot->state(0), OperatingState::kFault);
  EXPECT_EQ(system.robot->arm(0).power(), ArmPower::kOff);
  EXPECT_FALSE(system.robot->recovering(0));
}

TEST(Recovery, IsNotGivenBesideAnotherMasterNorKeptBesideOne) {
  System system(sharedBuses());
  ASSERT_TRUE(system.boot() && system.enable()) << system.story();
  const can::CanFrame sync = canopen::syncFrame(0);
  can::VirtualBus::Port& foreign = system.wires[1]->bus.join("foreign");
  foreign.send({&sync, 1});
  ASSERT_TRUE(system.until(1.0, [&] { return system.all(OperatingState::kFault); })) << system.story();
  system.hold();
  system.command.request[0] = DriveRequest::kKeep;
  system.run(0.2);
  system.command.request[0] = DriveRequest::kRecover;
  system.run(0.3);
  EXPECT_FALSE(system.robot->recovering(0)) << "the other one has not been silent for long enough";
}

TEST(Recovery, ANewSessionTakesOverBesideADriveThatDiedMoving) {
  System system;
  ASSERT_TRUE(system.boot() && system.enable());
  system.move(0, ArmVector::Constant(6, 4e-3));
  system.run(0.5);
  ASSERT_TRUE(system.inject(0, FaultKind::kOff, 2));
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->state(0) == OperatingState::kFault; }));
  system.hold();
  system.run(1.0);
  EXPECT_TRUE(system.robot->standing());
  EXPECT_EQ(system.robot->velocity(0)[1], 0.0);
}

TEST(Recovery, LeavesOutTheRequestedJoints) {
  System system;
  ASSERT_TRUE(system.boot());
  system.command.without[0] = jointBit(2);
  system.command.request[0] = DriveRequest::kRecover;
  ASSERT_TRUE(system.until(3.0, [&] { return system.robot->recovering(0); })) << system.story();
  system.command.request[0] = DriveRequest::kKeep;
  EXPECT_EQ(system.robot->lost(0), jointBit(2));
  const double before = system.truth(0, 2);
  system.move(0, ArmVector::Constant(6, 2e-3));
  system.run(0.5);
  EXPECT_NEAR(system.truth(0, 2), before, 1e-6);
  EXPECT_NE(system.drive(0, 2).state(), sim::drives::DriveState::kEnabled);
}

/** Random sequences of an arm: no motion in one period exceeds that of an axis, in particular after a recovery. */
TEST(Recovery, NoRandomSequenceOfEnableJogFaultRecoverDisableJumps) {
  // Excludes a rotor that comes loose, and a drive that reports another position than it holds: such motors jump
  // whatever the command.
  constexpr FaultKind kKinds[] = {FaultKind::kOff,          FaultKind::kOverCurrent,     FaultKind::kFrameLoss,
                                  FaultKind::kEncoderAlarm, FaultKind::kOverTemperature, FaultKind::kIntermittent};
  constexpr int kLife = 25;  // sequences of one robot
  double worst = 0.0;        // share of one period's travel
  for (std::uint32_t life = 0; life < tandem::test::cases(400) / kLife; ++life) {
    SCOPED_TRACE(tandem::test::trace(tandem::test::baseSeed() + life));
    tandem::test::Random random(tandem::test::baseSeed() + life);
    System system(life % 2 == 0 ? presetHardware() : outsideHardware(startOfFirst()));
    ASSERT_TRUE(system.boot());
    ArmVector before = system.truth(0);
    system.after_period = [&] {
      const ArmVector now = system.truth(0);
      for (int j = 0; j < 6; ++j) {
        const AxisConfig& axis = system.config.axes[static_cast<std::size_t>(j)];
        const double counts = 2.0 * AxisUnits(axis.encoder->gearing).resolution();
        worst = std::max(worst, (std::abs(now[j] - before[j]) - counts) / (axis.velocity * system.config.period));
      }
      before = now;
    };
    for (int i = 0; i < kLife; ++i) {
      const DriveRequest power = random.chance(0.3) ? DriveRequest::kRecover : DriveRequest::kEnable;
      system.command.without[0] = random.chance(0.2) ? jointBit(random.integer(0, 5)) : JointMask{0};
      system.request(power);
      system.run(random.uniform(0.1, 0.4));
      system.request(DriveRequest::kKeep);
      ArmVector v(6);
      for (int j = 0; j < 6; ++j)
        v[j] = random.uniform(-1.0, 1.0) * (j < 3 ? 8e-3 : 1.5);
      system.move(0, v);
      system.run(random.uniform(0.0, 0.4));
      if (random.chance(0.5))
        system.inject(0, kKinds[random.integer(0, 5)], random.integer(1, 6) + (random.chance(0.3) ? 16 : 0), 0.0,
                      random.uniform(0.05, 1.0));
      system.run(random.uniform(0.0, 0.3));
      if (random.chance(0.2))
        system.robot->stop();
      if (random.chance(0.2))
        system.robot->home(0, system.now);
      if (random.chance(0.5))
        system.hold();
      system.request(random.chance(0.8) ? DriveRequest::kDisable : DriveRequest::kRecover);
      system.run(random.uniform(0.0, 0.6));
    }
  }
  // A lost target is made up for with the next one; the overspeed guard permits exactly that.
  EXPECT_LE(worst, safety::kOverspeedFactor) << "of one period's travel at the fastest that an axis may be";
  RecordProperty("largest_share_of_a_periods_travel", std::to_string(worst));
}

TEST(LossOfOneAxis, ARequestFromBeforeItRecoversNothing) {
  System system;
  ASSERT_TRUE(system.boot());
  ASSERT_TRUE(system.enable());
  ASSERT_TRUE(system.inject(0, FaultKind::kOff, 2));
  ASSERT_TRUE(system.until(2.0, [&] {
    return system.robot->state(0) == OperatingState::kFault && system.robot->arm(0).power() == ArmPower::kOff;
  }));
  system.command.request[0] = DriveRequest::kRecover;
  system.command.unseen[0] = true;
  for (int k = 0; k < 50; ++k) {
    system.run(0.05);
    ASSERT_EQ(system.robot->arm(0).power(), ArmPower::kOff) << "drives get torque";
  }
  system.command.request[0] = DriveRequest::kKeep;
  system.command.unseen[0] = false;
  system.run(0.2);
  system.command.request[0] = DriveRequest::kRecover;
  EXPECT_TRUE(system.until(3.0, [&] { return system.robot->recovering(0); })) << system.story();
}

TEST(LossOfOneAxis, WithoutAPositionEverReadIsNotRecoveredFrom) {
  System system;
  ASSERT_TRUE(system.inject(0, FaultKind::kOff, 2));
  system.robot->start(system.now);
  ASSERT_TRUE(system.until(10.0, [&] { return system.robot->arm(0).axis(1).phase() == AxisPhase::kFailed; }));
  system.command.request[0] = DriveRequest::kRecover;
  system.run(2.0);
  EXPECT_FALSE(system.robot->recovering(0)) << "nobody knows where joint 2 is";
  EXPECT_EQ(system.robot->arm(0).power(), ArmPower::kOff);
}

}  // namespace
}  // namespace tandem::hal::test
