// SPDX-License-Identifier: Apache-2.0
/** @file Several clients that acquire, lose and release the lease, and their motions. */
#include <gtest/gtest.h>

#include <deque>

#include "tests/unit/operation/commanded_robot.h"

namespace tandem::test {
namespace {

/// The next client may send a request before control's next cycle has detected that the last one is gone.
TEST(Commanders, LostLeaseEndsItsMotion) {
  for (const bool by_crtk : {false, true}) {
    CommandedRobot robot;
    robot.enable(kFirst);
    ASSERT_EQ(robot.give(robot.moveRequest(kFirst, 0)), Reason::kNone);
    robot.run(0.1, kFirst);
    ASSERT_TRUE(robot.moves(0));
    robot.run(0.5);
    ASSERT_TRUE(robot.moves(0));
    robot.now += robot.lease() - kSecond / 2;  // from the last heartbeat of the first client on
    if (by_crtk) {
      CrtkRequest hold;
      for (std::size_t v = 0; v < kCrtkVerbs.size(); ++v) {
        if (actionOf(kCrtkVerbs[v]) == Action::kCrtkMove)
          hold.verb = static_cast<int>(v);
      }
      hold.group = 1;
      EXPECT_FALSE(robot.core.crtk(hold, robot.now).accepted) << "the arms are in FAULT by now";
    } else {
      EXPECT_EQ(robot.give(robot.requestOf(kSecondClient, ControlKind::kAcquireLease)), Reason::kNone);
    }
    robot.cycle();
    EXPECT_FALSE(robot.moves(0));
    EXPECT_EQ(robot.output.status.faults[0], bit(Fault::kLeaseLost));
    EXPECT_EQ(robot.output.status.lease_owner, by_crtk ? 0 : kSecondClient);
  }
}

TEST(Commanders, ADisableClearsNoFaultThatItsSenderHasNotSeen) {
  CommandedRobot robot;
  robot.enable(kFirst);
  const ParsedControlRequest early = robot.stateRequest(kFirst, StateCommand::kDisable);
  robot.core.stop();
  robot.cycle();
  EXPECT_EQ(robot.give(early), Reason::kFaultNotSeen);
  robot.cycle();
  EXPECT_EQ(robot.state(0), OperatingState::kFault);
  const ParsedControlRequest seen = robot.stateRequest(kFirst, StateCommand::kDisable);
  // The stop is pressed again.
  robot.core.stop();
  EXPECT_EQ(robot.give(seen), Reason::kFaultNotSeen) << "not shown yet";
  robot.cycle();
  EXPECT_EQ(robot.give(seen), Reason::kFaultNotSeen);
  ParsedControlRequest foreign = robot.stateRequest(kFirst, StateCommand::kDisable);
  foreign.control_session += 1;
  EXPECT_EQ(robot.give(foreign), Reason::kFaultNotSeen) << "another control's status";
  EXPECT_EQ(robot.give(robot.stateRequest(kFirst, StateCommand::kDisable)), Reason::kNone);
  robot.cycle();
  EXPECT_EQ(robot.state(0), OperatingState::kDisabled);
}

/// Two requests may arrive within one cycle, with a fault between them: no status has shown the end of the first fault.
TEST(Commanders, AFaultThatComesAgainIsAnother) {
  CommandedRobot robot;
  robot.enable(kFirst);
  robot.drives.state.faults[0] = bit(Fault::kDrive);
  robot.cycle();
  ASSERT_EQ(robot.state(0), OperatingState::kFault);
  const ParsedControlRequest disable = robot.stateRequest(kFirst, StateCommand::kDisable);
  EXPECT_EQ(robot.give(disable), Reason::kNone);
  robot.drives.state.answers_command = robot.output.command.sequence + 1;
  robot.drives.state.sequence += 1;
  robot.core.onState(robot.drives.state);
  EXPECT_EQ(robot.give(disable), Reason::kFaultNotSeen);
}

TEST(Commanders, ADisableOfAllTakesThePowerOfArmsWithoutFaults) {
  CommandedRobot robot;
  robot.enable(kFirst);
  const ParsedControlRequest early = robot.stateRequest(kFirst, StateCommand::kDisable);
  robot.drives.state.faults[0] = bit(Fault::kDrive);
  robot.cycle();
  robot.drives.state.faults[0] = 0;
  ASSERT_EQ(robot.state(0), OperatingState::kFault);
  ASSERT_EQ(robot.state(1), OperatingState::kEnabled);
  EXPECT_EQ(robot.give(early), Reason::kFaultNotSeen);
  robot.run(0.1);
  EXPECT_EQ(robot.state(0), OperatingState::kFault);
  EXPECT_EQ(robot.state(1), OperatingState::kDisabled);
}

TEST(Commanders, OneRequestEnablesAllArmsOrNone) {
  CommandedRobot robot;
  ASSERT_EQ(robot.give(robot.requestOf(kFirst, ControlKind::kAcquireLease)), Reason::kNone);
  ASSERT_EQ(robot.give(robot.stateRequest(kFirst, StateCommand::kEnable)), Reason::kNone);
  robot.cycle();
  robot.drives.take(robot.output.command);
  // The first arm has its power; the drives of the second one report a fault.
  robot.drives.state.operating_state[1] = static_cast<std::uint8_t>(OperatingState::kFault);
  robot.drives.state.faults[1] = bit(Fault::kDrive);
  robot.core.onState(robot.drives.state);
  robot.core.cycle(robot.now, false, robot.output);
  EXPECT_EQ(robot.output.command.request[0], static_cast<std::uint8_t>(safety::DriveRequest::kDisable));
  robot.run(0.1, kFirst);
  EXPECT_EQ(robot.state(0), OperatingState::kDisabled);
  EXPECT_EQ(robot.state(1), OperatingState::kFault);
}

TEST(Commanders, AnArmThatWorkedBeforeKeepsItsPower) {
  CommandedRobot robot;
  ASSERT_EQ(robot.give(robot.requestOf(kFirst, ControlKind::kAcquireLease)), Reason::kNone);
  ParsedControlRequest one = robot.stateRequest(kFirst, StateCommand::kEnable);
  one.arm = 0;
  ASSERT_EQ(robot.give(one), Reason::kNone);
  robot.run(0.1, kFirst);
  ASSERT_EQ(robot.state(0), OperatingState::kEnabled);
  ASSERT_EQ(robot.give(robot.stateRequest(kFirst, StateCommand::kEnable)), Reason::kNone);
  robot.drives.state.faults[1] = bit(Fault::kDrive);
  robot.core.onState(robot.drives.state);
  robot.run(0.1, kFirst);
  EXPECT_EQ(robot.state(1), OperatingState::kFault);
  EXPECT_EQ(robot.state(0), OperatingState::kEnabled);
}

TEST(Commanders, AJogThatALinkHeldBackMovesNothing) {
  CommandedRobot robot;
  robot.enable(kFirst);
  const ParsedControlRequest jog = robot.jogRequest(kFirst, 0);
  EXPECT_EQ(robot.give(jog), Reason::kNone);
  robot.run(1.0, kFirst);
  ASSERT_FALSE(robot.moves(0)) << "it lasts for a snapshot";
  EXPECT_EQ(robot.give(jog), Reason::kLate);
  ParsedControlRequest foreign = robot.jogRequest(kFirst, 0);
  foreign.control_session += 1;
  EXPECT_EQ(robot.give(foreign), Reason::kOtherControl);
  robot.cycle();
  EXPECT_FALSE(robot.moves(0));
}

/** Three clients, delayed requests, a robot with faults, and a model of the client that moves each arm. */
class Crowd {
 public:
  explicit Crowd(std::uint32_t seed) : random_(seed) {}
  int moved = 0, losses = 0, late_disables = 0, handed_over = 0;

  void step() {
    const std::int64_t between = random_.integer(0, static_cast<int>(robot_.rig.period()));
    robot_.now += between;
    for (std::size_t c = 0; c < clients_.size(); ++c) {
      if (clients_[c].alive && random_.chance(0.2))
        give(robot_.requestOf(idOf(c), ControlKind::kAcquireLease));
    }
    const int orders = random_.integer(0, 2);
    for (int i = 0; i < orders; ++i)
      deliver();
    if (random_.chance(0.003)) {
      robot_.core.stop();
      stopped_at_ = robot_.output.status.sequence + 1;
    }
    if (random_.chance(0.001))
      robot_.drives.state.faults[static_cast<std::size_t>(random_.integer(0, 1))] = bit(Fault::kDrive);
    keep();
    robot_.now -= between;
    robot_.cycle();
    judge();
  }

 private:
  struct Client {
    bool alive = true;
    std::deque<ParsedControlRequest> on_their_way;
  };

  /// Running clients renew the lease in time.
  void keep() {
    for (std::size_t c = 0; c < clients_.size(); ++c) {
      if (clients_[c].alive && random_.chance(0.3))
        give(robot_.requestOf(idOf(c), ControlKind::kKeepLease));
      if (random_.chance(clients_[c].alive ? 0.01 : 0.004))
        clients_[c].alive = !clients_[c].alive;
    }
  }
  ParsedControlRequest anyRequest(std::uint64_t id) {
    switch (random_.integer(0, 9)) {
      case 0:
      case 1:
        return robot_.requestOf(id, ControlKind::kAcquireLease);
      case 2:
      case 3:
        return robot_.stateRequest(id, StateCommand::kEnable);
      case 4:
        return robot_.stateRequest(id, random_.chance(0.3) ? StateCommand::kPause : StateCommand::kResume);
      case 5:
        return random_.chance(0.3) ? robot_.stateRequest(id, StateCommand::kDisable)
                                   : robot_.requestOf(id, ControlKind::kHome);
      case 6:
        return robot_.requestOf(id, random_.chance(0.1) ? ControlKind::kReleaseLease : ControlKind::kKeepLease);
      case 7:
        return robot_.jogRequest(id, random_.integer(0, 1));
      default:
        return robot_.moveRequest(id, random_.integer(0, 1), random_.uniform(-1.5, 1.5));
    }
  }
  /// A new request of a client, or one that a link has delayed.
  void deliver() {
    const auto c = static_cast<std::size_t>(random_.integer(0, 2));
    Client& client = clients_[c];
    if (client.alive)
      client.on_their_way.push_back(anyRequest(idOf(c)));
    if (client.on_their_way.empty() || random_.chance(0.3))
      return;
    const ParsedControlRequest request = client.on_their_way.front();
    client.on_their_way.pop_front();
    give(request);
  }
  void give(const ParsedControlRequest& request) {
    const bool obeyed = robot_.give(request) == Reason::kNone;
    const RobotCondition after = robot_.core.condition();
    if (request.kind == ControlKind::kStateCommand && request.command == StateCommand::kDisable) {
      stop_latched_ = stop_latched_ && request.answers_control < stopped_at_;
      // Whatever its effect, the stop that its sender had not received is still latched.
      late_disables += request.answers_control < stopped_at_ ? 1 : 0;
      for (int k = 0; k < 2; ++k)
        EXPECT_TRUE(!stop_latched_ || after.arm[CommandedRobot::at(k)].wanted == OperatingState::kFault) << "arm " << k;
    }
    const bool begins =
        request.kind == ControlKind::kJog || request.kind == ControlKind::kMoveJp || request.kind == ControlKind::kHome;
    for (int k = 0; k < 2 && obeyed && begins; ++k) {
      if (request.arm == msg::kAllArms || request.arm == k)
        begun_by_[CommandedRobot::at(k)] = request.client;
    }
  }
  void judge() {
    const std::uint64_t owner = robot_.output.status.lease_owner;
    handed_over += owner != 0 && owner != owner_ && owner_ != 0 ? 1 : 0;
    owner_ = owner;
    stop_latched_ = (robot_.output.status.faults[0] & bit(Fault::kStopRequested)) != 0;
    for (int k = 0; k < 2; ++k) {
      losses += (robot_.output.status.faults[CommandedRobot::at(k)] & bit(Fault::kLeaseLost)) != 0 ? 1 : 0;
      if (!robot_.moves(k))
        continue;
      ++moved;
      EXPECT_EQ(owner, begun_by_[CommandedRobot::at(k)])
          << "arm " << k << " moves for somebody who does not hold the lease";
      EXPECT_EQ(robot_.state(k), OperatingState::kEnabled);
    }
  }
  static std::uint64_t idOf(std::size_t client) { return kFirst + client; }

  Random random_;
  CommandedRobot robot_;
  std::array<Client, 3> clients_;
  std::array<std::uint64_t, 2> begun_by_{};
  std::uint64_t owner_ = 0, stopped_at_ = 0;
  bool stop_latched_ = false;
};

TEST(Commanders, NoArmMovesForAClientWithoutTheLease) {
  int moved = 0, losses = 0, late_disables = 0, handed_over = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(100); ++seed) {
    SCOPED_TRACE(trace(seed));
    Crowd crowd(seed);
    for (int i = 0; i < 1000; ++i) {
      crowd.step();
      ASSERT_FALSE(HasFailure()) << "step " << i;
    }
    moved += crowd.moved;
    losses += crowd.losses;
    late_disables += crowd.late_disables;
    handed_over += crowd.handed_over;
  }
  EXPECT_GT(moved, 2000);
  EXPECT_GT(losses, 100);
  EXPECT_GT(late_disables, 30);
  EXPECT_GT(handed_over, 10);
}

}  // namespace
}  // namespace tandem::test
