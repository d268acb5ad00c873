// SPDX-License-Identifier: Apache-2.0
/** @file Unit tests of the parts of operation/. */
#include <gtest/gtest.h>

#include <numeric>

#include "operation/arm_states.h"
#include "operation/followed_reference.h"
#include "operation/joint_motions.h"
#include "safety/joint_motion.h"
#include "tests/unit/operation/rig.h"

namespace tandem::test {
namespace {

using namespace operation;
using safety::DriveRequest;
using safety::OperatingState;
using safety::StateCommand;

TEST(DriveExchange, ContinuesFromTheLastSentCommand) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(50); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Rig rig;
    Drives drives(rig);
    DriveExchange exchange(rig.setup());
    exchange.take(drives.state);
    exchange.readJoints();
    safety::RobotVector expected = exchange.setpoints();
    std::deque<msg::ActuationCommand> under_way;
    const std::size_t late = static_cast<std::size_t>(random.integer(0, 10));
    for (std::int64_t now = kSecond; now < 2 * kSecond; now += rig.period()) {
      exchange.begin(now);
      ASSERT_LT((exchange.setpoints() - expected).cwiseAbs().maxCoeff(), 1e-12);
      Velocities velocities;
      velocities.value = safety::RobotVector::Constant(12, random.uniform(-1e-2, 1e-2));
      velocities.moves = {random.chance(0.8), random.chance(0.8)};
      exchange.send(now, false, velocities, under_way.emplace_back());
      for (int k = 0; k < 2; ++k) {
        if (velocities.moves[static_cast<std::size_t>(k)])
          expected.segment(6 * k, 6) += rig.deployment.control_period * velocities.value.segment(6 * k, 6);
      }
      EXPECT_EQ(exchange.lastSent().head(6).isZero(0.0), !velocities.moves[0]);
      if (under_way.size() > late) {
        drives.take(under_way.front());
        under_way.pop_front();
        exchange.take(drives.state);
      }
    }
  }
}

TEST(DriveExchange, AcceptsOnlyItsOwnRobot) {
  Rig rig;
  Drives drives(rig);
  DriveExchange exchange(rig.setup());
  msg::ActuationState foreign = drives.state;
  foreign.arm_count = 3;
  EXPECT_FALSE(exchange.take(foreign).ours);
  foreign = drives.state;
  foreign.joint_count[1] = 5;
  EXPECT_FALSE(exchange.take(foreign).ours);
  EXPECT_FALSE(exchange.received());
  EXPECT_TRUE(exchange.take(drives.state).ours);
  foreign = drives.state;
  ++foreign.joint_resets;
  DriveExchange::StateUpdate update = exchange.take(foreign);
  EXPECT_TRUE(update.displaced && !update.restarted);
  ++foreign.session;
  update = exchange.take(foreign);
  EXPECT_TRUE(update.displaced && update.restarted);
}

/** States of the arms with drives that follow them or change randomly. */
TEST(ArmStates, PowerIsAskedForOnlyAfterACommandAndNeverAfterAFault) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(100); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Rig rig;
    Drives drives(rig);
    DriveExchange exchange(rig.setup());
    ArmStates arms(rig.setup(), exchange);
    exchange.take(drives.state);
    bool requested = false;
    std::int64_t now = kSecond;
    for (int i = 0; i < 300; ++i, now += rig.period()) {
      ArmCondition arm;
      arms.fill(0, arm);
      const auto command = static_cast<StateCommand>(random.chance(0.9) ? -1 : random.integer(0, 6));
      const auto next = command <= StateCommand::kRecover ? safety::transition(arm.wanted, command) : std::nullopt;
      if (next) {
        arms.apply(command, 0, 0, now);
        requested = *next == OperatingState::kEnabled && (requested || command != StateCommand::kHome);
        arms.fill(0, arm);
        EXPECT_EQ(arm.wanted, *next);
      }
      if (random.chance(0.02)) {
        arms.latch(0, {bit(safety::Fault::kSolver)});
        requested = false;
      }
      msg::ActuationCommand sent;
      exchange.send(now, false, Velocities{safety::RobotVector::Zero(12), {}}, sent);
      arms.fill(sent);
      const DriveRequest request = arms.requestFor(0);
      const bool gives_power =
          request == DriveRequest::kEnable || request == DriveRequest::kResume || request == DriveRequest::kRecover;
      EXPECT_LE(gives_power, requested);
      EXPECT_LE(arms.mayMove(0), requested);
      EXPECT_LE(arms.powered(0), arms.mayMove(0));
      arms.fill(0, arm);
      EXPECT_EQ(arms.record(0).faults != 0, arm.wanted == OperatingState::kFault);
      if (random.chance(0.8))
        drives.take(sent);
      if (random.chance(0.02))
        drives.state.operating_state[0] = static_cast<std::uint8_t>(random.integer(0, 3));
      exchange.take(drives.state);
      arms.onState(false);
      arms.fill(0, arm);
      requested = requested && arm.wanted != OperatingState::kFault;
    }
  }
}

TEST(ArmStates, PowerThatDoesNotComeIsGivenUp) {
  Rig rig;
  Drives drives(rig);
  DriveExchange exchange(rig.setup());
  ArmStates arms(rig.setup(), exchange);
  exchange.take(drives.state);
  arms.apply(StateCommand::kEnable, 0, 0, kSecond);
  arms.giveUpPending(8 * kSecond);
  EXPECT_TRUE(arms.hasPendingDriveRequest());
  arms.giveUpPending(10 * kSecond);
  EXPECT_FALSE(arms.hasPendingDriveRequest());
  EXPECT_EQ(arms.record(0).cause, safety::FaultCause::kOff);
}

/// Random joints inside the limits, between home and two other such joint vectors.
safety::ArmVector inside(const Rig& rig, int arm, Random& random) {
  const safety::ArmVector home = rig.robot.arms[static_cast<std::size_t>(arm)].home;
  for (;;) {
    safety::ArmVector q = home;
    for (int j = 0; j < q.size(); ++j)
      q[j] += j < q.size() / 2 ? random.uniform(-0.01, 0.01) : random.uniform(-0.5, 0.5);
    if (safety::largestViolation(rig.setup().limits(arm), q) <= 0.0)
      return q;
  }
}

TEST(JointMotions, ArriveInsideTheLimitsAlthoughCommandsGetLost) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(30); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Rig rig;
    Drives drives(rig);
    DriveExchange exchange(rig.setup());
    JointMotions motions(rig.setup(), exchange);
    exchange.take(drives.state);
    exchange.readJoints();
    const safety::ArmVector goal = inside(rig, 0, random);
    const double loss = random.chance(0.5) ? 0.0 : random.uniform(0.0, 0.3);
    const safety::JointMotion ideal(rig.setup().limits(0), rig.robot.arms[0].home, goal);
    motions.unhome(0);
    motions.moveTo(0, goal);
    double seconds = 0.0;
    for (std::int64_t now = kSecond; motions.active(0); now += rig.period(), seconds += rig.deployment.control_period) {
      ASSERT_LT(seconds, ideal.duration() + 10.5);
      exchange.begin(now);
      Velocities velocities{safety::RobotVector::Zero(12), {}};
      motions.step(0, false, now, velocities);
      for (int j = 0; j < 6; ++j)
        ASSERT_LE(std::abs(velocities.value[j]), safety::moveVelocity(rig.setup().limits(0), j) + 1e-12);
      ASSERT_TRUE(velocities.value.tail(6).isZero(0.0)) << "of the other arm";
      msg::ActuationCommand command;
      exchange.send(now, false, velocities, command);
      if (!random.chance(loss))
        drives.take(command);
      exchange.take(drives.state);
      ASSERT_LE(safety::largestViolation(rig.setup().limits(0), msg::jointsOf(drives.state.position, 0, 6)), 1e-6);
    }
    EXPECT_LT((msg::jointsOf(drives.state.position, 0, 6) - goal).cwiseAbs().maxCoeff(), safety::kPositionTolerance);
    if (loss == 0.0) {
      EXPECT_LT(seconds, ideal.duration() + 1.0);
    }
    EXPECT_FALSE(motions.homed(0)) << "that was not home";
  }
}

TEST(JointMotions, AJogEndsByItselfAndIsSlowWhileTheArmIsRecovered) {
  Rig rig;
  Drives drives(rig);
  drives.state.lost[0] = safety::jointBit(1);
  DriveExchange exchange(rig.setup());
  JointMotions motions(rig.setup(), exchange);
  exchange.take(drives.state);
  exchange.begin(kSecond);
  motions.jog(0, safety::ArmVector::Constant(6, -0.05), kSecond);
  Velocities velocities{safety::RobotVector::Zero(12), {}};
  motions.step(0, true, kSecond, velocities);
  EXPECT_EQ(velocities.value[0], -safety::kRecoveryTranslation);
  EXPECT_EQ(velocities.value[1], 0.0) << "a lost joint";
  EXPECT_TRUE(velocities.moves[0] && !velocities.moves[1]);
  EXPECT_FALSE(motions.busy(0));
  velocities.moves = {};
  motions.step(0, true, 2 * kSecond, velocities);
  EXPECT_FALSE(motions.active(0) || velocities.moves[0]);
}

TEST(JointMotions, HomeIsForgottenUntilTheArmHasBeenThere) {
  Rig rig;
  Drives drives(rig);
  DriveExchange exchange(rig.setup());
  JointMotions motions(rig.setup(), exchange);
  exchange.take(drives.state);
  EXPECT_TRUE(motions.homed(0));
  motions.unhome(0);
  for (const bool all_the_way : {false, true}) {
    EXPECT_FALSE(motions.homed(0));
    exchange.readJoints();
    motions.home(0);
    EXPECT_TRUE(motions.homing(0));
    if (!all_the_way)
      motions.end(0);
    for (std::int64_t now = kSecond; motions.active(0) && now < 3 * kSecond; now += rig.period()) {
      exchange.begin(now);
      Velocities velocities{safety::RobotVector::Zero(12), {}};
      motions.step(0, false, now, velocities);
      msg::ActuationCommand command;
      exchange.send(now, false, velocities, command);
      drives.take(command);
      exchange.take(drives.state);
    }
    EXPECT_FALSE(motions.homing(0));
  }
  EXPECT_TRUE(motions.homed(0));
  drives.state.homed[0] = 0;
  exchange.take(drives.state);
  EXPECT_FALSE(motions.homed(0)) << "the drives say so";
}

msg::PlanningReference runningReference() {
  msg::PlanningReference reference;
  reference.state_session = kDriveSession;
  reference.trajectory_id = 4;
  reference.phase = static_cast<std::uint8_t>(planning::Phase::kRunning);
  reference.task_count = 1;
  reference.answers_control = 1;
  return reference;
}

TEST(FollowedReference, DoesNotResumeAfterItHasEndedOrIsStale) {
  Rig rig;
  const Drives drives(rig);
  FollowedReference followed(rig.setup());
  EXPECT_FALSE(followed.underWay(drives.state));
  msg::PlanningReference message = runningReference();
  followed.take(message);
  EXPECT_TRUE(followed.running(drives.state));
  message.phase = static_cast<std::uint8_t>(planning::Phase::kPaused);
  followed.take(message);
  EXPECT_TRUE(followed.underWay(drives.state) && !followed.running(drives.state));
  followed.spend();
  message = runningReference();
  followed.take(message);
  EXPECT_FALSE(followed.underWay(drives.state));
  ++message.trajectory_id;
  followed.take(message);
  EXPECT_TRUE(followed.running(drives.state)) << "another one";
  safety::StateStamps statuses;
  statuses.record(1, kSecond);
  EXPECT_EQ(followed.judge(statuses, kSecond + kSecond / 5).faults, 0u);
  EXPECT_TRUE(followed.running(drives.state));
  EXPECT_EQ(followed.judge(statuses, kSecond + kSecond / 2).faults, bit(safety::Fault::kReferenceTimeout));
  EXPECT_FALSE(followed.underWay(drives.state));
  ++message.state_session;
  followed.take(message);
  EXPECT_FALSE(followed.underWay(drives.state)) << "another robot's";
}

TEST(FollowedReference, APostureThatLimitsForbidIsLeftOut) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(100); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Rig rig;
    const Drives drives(rig);
    FollowedReference followed(rig.setup());
    msg::PlanningReference message = runningReference();
    safety::RobotVector posture(12);
    posture << inside(rig, 0, random), inside(rig, 1, random);
    const bool forbidden = random.chance(0.5);
    if (forbidden)
      posture[6 * random.integer(0, 1)] = 1e-3;  // past the entry
    msg::setPosture(posture, 2, drives.state.joint_count, message);
    followed.take(message);
    EXPECT_EQ(followed.tasks(drives.state).posture.size(), forbidden ? 0 : 12);
  }
}

}  // namespace
}  // namespace tandem::test
