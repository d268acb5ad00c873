// SPDX-License-Identifier: Apache-2.0
/** @file Faults detected by control: causes, messages, and conditions that are not faults. */
#include <gtest/gtest.h>

#include <cmath>

#include "operation/convert.h"
#include "services/runtime/fault_log.h"
#include "tests/unit/services/system.h"

namespace tandem::test {
namespace {

using safety::Fault;
using safety::FaultCause;
using safety::OperatingState;
using safety::StateCommand;

void expectSolverFault(System& s, FaultCause cause) {
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ(s.control.faultRecord(k).faults, bit(Fault::kSolver)) << safety::describe(s.control.faultRecord(k));
    EXPECT_EQ(s.control.faultRecord(k).cause, cause);
    EXPECT_EQ(s.output.command.moving[static_cast<std::size_t>(k)], 0);
  }
  s.state_link = true;
  s.run(0.3);
  EXPECT_TRUE(s.standing());
  EXPECT_EQ(s.shown(0), OperatingState::kFault);
  EXPECT_EQ(s.drives(0), OperatingState::kDisabled) << "control takes the power away";
  s.sendRequest(dds::ControlKind::kKeepLease);
  EXPECT_EQ(s.command(StateCommand::kDisable).refusal.code(), dds::ReplyCode::kOk);
  EXPECT_EQ(s.control.faultRecord(0).faults, 0u);
}

TEST(Faults, JointsForWhichTheModelHasNoAnswerStopTheRobot) {
  System s;
  s.getMoving();
  s.state_link = false;
  dds::ActuationState beyond = s.state;
  beyond.position[dds::jointIndex(1, 0)] = -0.44;  // the innermost tube, withdrawn from the others
  s.control.onState(beyond);
  s.control.cycle(s.now, false, s.output);
  expectSolverFault(s, FaultCause::kModel);
}

TEST(Faults, AnEquationThatStaysWithoutSolutionStopsTheRobot) {
  System s;
  s.getMoving();
  s.planning_runs = false;
  dds::PlanningReference absurd = s.reference_message;
  absurd.tasks[0].position[0] = 1e308;  // finite, but the resulting velocity is not
  const double allowed = s.setup.deployment.budgets.commandAge(s.setup.deployment.control_period);
  const std::uint64_t first = s.output.command.sequence;
  for (int i = 0; i < 2000 && s.control.faultRecord(0).faults == 0; ++i) {
    absurd.answers_control = s.output.status.sequence;
    s.control.onReference(absurd);
    s.tick();
    for (const double velocity : s.output.command.velocity)
      ASSERT_TRUE(velocity == 0.0 || s.output.command.sequence == first) << "what could not be solved moves nothing";
  }
  const std::uint64_t cycles = s.output.command.sequence - first;
  EXPECT_EQ(cycles, static_cast<std::uint64_t>(std::lround(allowed / s.setup.deployment.control_period)) + 1);
  expectSolverFault(s, FaultCause::kNoSolution);
}

TEST(Faults, ReachControlAndHalStatusWithTheirCause) {
  System s;
  s.getMoving();
  dds::SimRequest stick;
  stick.kind = 3;
  stick.arm = 1;
  stick.joint = 0;
  stick.fault = "stuck";
  ASSERT_EQ(s.sim.onRequest(stick).accepted, 1);
  const double seconds = s.until([&] { return s.drives(1) == OperatingState::kFault; }, 3.0);
  ASSERT_GE(seconds, 0.0);
  s.run(0.2);
  const safety::FaultRecord record = dds::faultRecordOf(s.hal, 1);
  EXPECT_EQ(record.cause, FaultCause::kFollowingError);
  EXPECT_EQ(record.joint, 0);
  EXPECT_GT(record.amount, record.allowed);
  EXPECT_EQ(dds::faultRecordOf(s.hal, 0).faults, 0u);
  EXPECT_EQ(s.control.faultRecord(1).cause, FaultCause::kReported);
  const std::string text = runtime::describe(s.setup.robot, {1, record});
  EXPECT_EQ(text.rfind("arm_b: drive (following error) of joint 1: ", 0), 0u) << text;
  runtime::FaultWatch watch;
  EXPECT_TRUE(watch.fresh(1, record));
  EXPECT_FALSE(watch.fresh(1, record));
  EXPECT_FALSE(watch.fresh(1, {}));
  EXPECT_TRUE(watch.fresh(1, record));
}

TEST(Faults, RequestRightAfterItsOppositeCausesNoFault) {
  // The drives reply to the first request after the second one was sent.
  for (const auto& [first, second] : {std::pair(StateCommand::kDisable, StateCommand::kEnable),
                                      std::pair(StateCommand::kPause, StateCommand::kResume)}) {
    for (int delay = 0; delay < 8; ++delay) {
      System s("laptop-1khz");
      s.run(0.3);
      s.sendRequest(dds::ControlKind::kAcquireLease);
      s.command(StateCommand::kEnable);
      s.run(0.1);
      ASSERT_EQ(s.shown(0), OperatingState::kEnabled);
      ASSERT_EQ(s.command(first).refusal.code(), dds::ReplyCode::kOk);
      s.state_link = delay % 2 == 0;
      for (int i = 0; i < delay; ++i)
        s.tick();
      ASSERT_EQ(s.command(second).refusal.code(), dds::ReplyCode::kOk);
      s.state_link = true;
      s.run(0.1);
      EXPECT_EQ(s.shown(0), OperatingState::kEnabled) << delay << ": " << safety::describe(s.control.faultRecord(0));
      EXPECT_EQ(s.drives(0), OperatingState::kEnabled);
    }
  }
}

TEST(Faults, AStopStaysLatchedInDrivesWhoseFaultControlHadNotSeen) {
  // Both receive the stop at once; control's following request is based on a state in which the drives were ENABLED.
  for (int delay = 1; delay < 60; delay += 7) {
    SCOPED_TRACE(delay);
    System s;
    s.command_delay = delay;
    s.getMoving();
    while (s.ticks % s.control_every != s.control_every - 1)
      s.tick();
    s.control.stop();
    s.tick();
    ASSERT_EQ(s.output.command.request[0], static_cast<std::uint8_t>(safety::DriveRequest::kDisable));
    s.sim.onStop();
    s.run(0.3);
    EXPECT_TRUE(s.standing());
    for (int k = 0; k < 2; ++k) {
      EXPECT_EQ(s.drives(k), OperatingState::kFault);
      EXPECT_EQ(s.state.faults[static_cast<std::size_t>(k)], bit(Fault::kStopRequested));
    }
    s.sendRequest(dds::ControlKind::kKeepLease);
    ASSERT_EQ(s.command(StateCommand::kDisable).refusal.code(), dds::ReplyCode::kOk);
    s.run(0.3);
    EXPECT_EQ(s.drives(0), OperatingState::kDisabled) << "a disable of somebody who has seen the fault clears it";
    EXPECT_EQ(s.state.faults[0], 0u);
  }
}

TEST(Faults, OfTimeSayWhereThisPcWasLate) {
  const System s;
  const auto words = [&](Fault fault, double late) {
    return runtime::describe(s.setup.robot, {0, {.faults = bit(fault)}, late});
  };
  EXPECT_NE(words(Fault::kStateTimeout, 0.31).find("wake-up delay of 0.31 s"), std::string::npos);
  EXPECT_EQ(words(Fault::kStateTimeout, 0.001).find("late"), std::string::npos) << "who is silent is gone";
  EXPECT_EQ(words(Fault::kDrive, 0.31).find("late"), std::string::npos) << "time has nothing to do with it";
}

}  // namespace
}  // namespace tandem::test
