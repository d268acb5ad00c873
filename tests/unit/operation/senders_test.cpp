// SPDX-License-Identifier: Apache-2.0
/** @file Identity and knowledge of senders: stamps of state_command, fingerprints, client that paused. */
#include "tests/unit/operation/commanded_robot.h"

namespace tandem::test {
namespace {

/// CRTK clients prove what they have received by the stamp of the feedback that they repeat.
TEST(StateCommand, PowerNeedsAFreshFeedbackStamp) {
  const auto topic = [](const CommandedRobot& robot, StateCommand command) {
    ParsedControlRequest request = robot.stateRequest(0, command);
    request.from_topic = true;
    return request;
  };
  CommandedRobot robot;
  ParsedControlRequest blind = topic(robot, StateCommand::kEnable);
  blind.answers_control = 0;
  EXPECT_EQ(robot.give(blind), Reason::kNoEcho);
  const ParsedControlRequest held_back = topic(robot, StateCommand::kEnable);
  robot.run(1.05 * robot.rig.deployment.budgets.lease);
  EXPECT_EQ(robot.give(held_back), Reason::kNoEcho);
  EXPECT_EQ(robot.state(0), OperatingState::kDisabled);
  EXPECT_EQ(robot.give(topic(robot, StateCommand::kEnable)), Reason::kNone);
  robot.run(0.1);
  EXPECT_EQ(robot.state(0), OperatingState::kEnabled);
  // Removing power needs no received feedback.
  ParsedControlRequest pause = topic(robot, StateCommand::kPause), disable = topic(robot, StateCommand::kDisable);
  pause.answers_control = disable.answers_control = 0;
  EXPECT_EQ(robot.give(pause), Reason::kNone);
  robot.run(0.03);
  EXPECT_EQ(robot.state(0), OperatingState::kPaused);
  ParsedControlRequest resume = topic(robot, StateCommand::kResume);
  resume.answers_control = 0;
  EXPECT_EQ(robot.give(resume), Reason::kNoEcho);
  EXPECT_EQ(robot.give(disable), Reason::kNone);
  robot.run(0.03);
  EXPECT_EQ(robot.state(0), OperatingState::kDisabled);
  // But clearing a stop requires knowledge of it.
  const ParsedControlRequest early = topic(robot, StateCommand::kDisable);
  robot.core.stop();
  robot.cycle();
  EXPECT_EQ(robot.give(early), Reason::kFaultNotSeen);
  EXPECT_EQ(robot.give(disable), Reason::kFaultNotSeen);
  EXPECT_EQ(robot.state(0), OperatingState::kFault);
  EXPECT_EQ(robot.give(topic(robot, StateCommand::kDisable)), Reason::kNone);
}

TEST(Mismatch, StopsWhatMovesAndLetsNothingBeginUntilItIsOver) {
  CommandedRobot robot;
  robot.enable(kFirst);
  ASSERT_EQ(robot.give(robot.moveRequest(kFirst, 0)), Reason::kNone);
  robot.run(0.1, kFirst);
  ASSERT_TRUE(robot.moves(0));
  robot.core.onMismatch(robot.now);
  robot.cycle();
  EXPECT_FALSE(robot.moves(0));
  EXPECT_EQ(robot.output.status.faults[0], bit(Fault::kMismatch));
  EXPECT_EQ(robot.give(robot.stateRequest(kFirst, StateCommand::kDisable)), Reason::kNone) << "power may always go";
  robot.run(0.1, kFirst);
  for (const StateCommand command : {StateCommand::kEnable, StateCommand::kRecover})
    EXPECT_EQ(robot.give(robot.stateRequest(kFirst, command)), Reason::kMismatch);
  robot.core.onMismatch(robot.now);
  robot.run(0.9, kFirst);
  EXPECT_EQ(robot.give(robot.stateRequest(kFirst, StateCommand::kEnable)), Reason::kMismatch);
  robot.run(0.2, kFirst);
  EXPECT_EQ(robot.give(robot.stateRequest(kFirst, StateCommand::kEnable)), Reason::kNone);
}

TEST(Commanders, PauseNamesTheClient) {
  CommandedRobot robot;
  robot.enable(kFirst);
  EXPECT_EQ(robot.output.status.paused_by, 0u);
  ASSERT_EQ(robot.give(robot.stateRequest(kSecondClient, StateCommand::kPause)), Reason::kNone);
  robot.run(0.03, kFirst);
  EXPECT_EQ(robot.output.status.paused_by, kSecondClient);
  EXPECT_EQ(robot.core.onRequest(robot.stateRequest(kSecondClient, StateCommand::kResume), robot.now).owner, kFirst);
  ASSERT_EQ(robot.give(robot.stateRequest(kFirst, StateCommand::kResume)), Reason::kNone);
  robot.run(0.05, kFirst);
  EXPECT_EQ(robot.output.status.paused_by, 0u);
}

}  // namespace
}  // namespace tandem::test
