// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/unit/safety/allocation_counter.h"
#include "tests/unit/services/system.h"

namespace tandem::test {
namespace {

using dds::ControlKind;
using safety::Fault;
using safety::OperatingState;
using safety::StateCommand;

bool faulted(const System& s, Fault fault) { return (s.output.status.faults[0] & bit(fault)) != 0; }

TEST(ControlCore, OneCommanderAtATime) {
  System s;
  s.run(0.2);
  EXPECT_EQ(s.command(StateCommand::kEnable).refusal.code(), dds::ReplyCode::kNotLeaseOwner);
  EXPECT_EQ(s.sendRequest(ControlKind::kAcquireLease, 7).refusal.code(), dds::ReplyCode::kOk);
  EXPECT_EQ(s.sendRequest(ControlKind::kAcquireLease, 8).refusal.code(), dds::ReplyCode::kLeaseTaken);
  EXPECT_EQ(s.command(StateCommand::kEnable, 8).refusal.code(), dds::ReplyCode::kNotLeaseOwner);
  EXPECT_EQ(s.command(StateCommand::kEnable, 7).refusal.code(), dds::ReplyCode::kOk);
  s.run(0.3);
  EXPECT_EQ(s.shown(0), OperatingState::kEnabled);
  EXPECT_EQ(s.command(StateCommand::kPause, 8).refusal.code(), dds::ReplyCode::kOk);  // any client may remove power
  EXPECT_EQ(s.sendRequest(ControlKind::kReleaseLease, 7).refusal.code(), dds::ReplyCode::kOk);
  EXPECT_EQ(s.sendRequest(ControlKind::kAcquireLease, 8).refusal.code(), dds::ReplyCode::kOk);
}

TEST(ControlCore, AnArmIsHomedWhenItsDrivesSaySo) {
  System s;
  s.run(0.2);
  s.sendRequest(ControlKind::kAcquireLease);
  EXPECT_EQ(s.output.status.homed[0], 1);
  s.state_link = false;
  dds::ActuationState unknown = s.state;
  unknown.homed[0] = 0;
  ++unknown.sequence;
  s.control.onState(unknown);
  const operation::ControlReply answer = s.command(StateCommand::kEnable);
  EXPECT_EQ(answer.refusal.code(), dds::ReplyCode::kWrongState);
  const std::string reason = describe(answer.refusal, s.setup.robot);
  EXPECT_NE(reason.find("arm_a: the drives are not homed"), std::string::npos) << reason;
  EXPECT_NE(reason.find("tandem home"), std::string::npos) << reason;
  s.control.cycle(s.now, false, s.output);
  EXPECT_EQ(s.output.status.homed[0], 0);
  EXPECT_EQ(s.output.status.homed[1], 1);
}

TEST(ControlCore, EnablingDoesNotMove) {
  System s;
  s.run(0.3);
  const auto before = s.state.position;
  s.sendRequest(ControlKind::kAcquireLease);
  s.command(StateCommand::kEnable);
  for (int i = 0; i < 800; ++i) {
    s.tick();
    ASSERT_EQ(s.state.position, before);
    if (i % 300 == 0)
      s.sendRequest(ControlKind::kKeepLease);
  }
  EXPECT_EQ(s.drives(0), OperatingState::kEnabled);
  EXPECT_EQ(s.drives(1), OperatingState::kEnabled);
}

TEST(ControlCore, FollowsAReferenceAtBothRates) {
  for (const char* deployment : {"laptop", "laptop-1khz"}) {
    System s(deployment);
    s.getMoving();
    EXPECT_FALSE(s.standing()) << deployment;
    const double ended = s.until(
        [&] {
          if (s.ticks % 200 == 0)
            s.sendRequest(ControlKind::kKeepLease);
          return s.reference_message.phase == static_cast<std::uint8_t>(planning::Phase::kFinished);
        },
        20.0);
    EXPECT_GT(ended, 0.0) << deployment;
    EXPECT_LT(s.output.status.faults[0], 1u) << deployment;
    for (std::uint64_t count : s.hal.guard_count)
      EXPECT_EQ(count, 0u) << deployment;
  }
}

TEST(ControlCore, StopsWhenPlanningFallsSilent) {
  System s;
  s.getMoving();
  ASSERT_FALSE(s.standing());
  s.planning_runs = false;
  const double seconds = s.until([&] { return s.standing(); }, 1.0);
  EXPECT_GE(seconds, 0.0);
  EXPECT_LE(seconds, 0.25 + 0.1 + 5e-3 / 0.1 + 0.01);  // budget, one period, ramp
  s.run(0.2);
  EXPECT_TRUE(faulted(s, Fault::kReferenceTimeout));
  s.planning_runs = true;  // it resumes: nothing moves
  const auto there = s.state.position;
  s.run(1.0);
  EXPECT_EQ(s.state.position, there);
  EXPECT_EQ(s.command(StateCommand::kEnable).refusal.code(),
            dds::ReplyCode::kNotLeaseOwner);  // the lease is lost as well
}

TEST(ControlCore, SimulatedDrivesStopWhenControlFallsSilent) {
  System s;
  s.getMoving();
  s.control_runs = false;
  const double seconds = s.until([&] { return s.standing(); }, 1.0);
  EXPECT_GE(seconds, 0.0);
  EXPECT_LE(seconds, 0.3 + 5e-3 / 0.1);
  s.run(0.4);
  EXPECT_EQ(s.drives(0), OperatingState::kFault);
  EXPECT_TRUE(s.state.faults[0] & bit(Fault::kCommandTimeout));
  s.control_runs = true;
  const auto there = s.state.position;
  s.run(1.0);
  EXPECT_EQ(s.state.position, there);
  EXPECT_EQ(s.shown(0), OperatingState::kFault);
}

TEST(ControlCore, StopsWhenStatesNoLongerArrive) {
  System s;
  s.getMoving();
  s.state_link = false;
  const double seconds = s.until([&] { return s.standing(); }, 2.0);
  EXPECT_GE(seconds, 0.0);
  EXPECT_LE(seconds, 0.3 + 0.1 + 5e-3 / 0.1 + 0.3);
  EXPECT_TRUE(faulted(s, Fault::kStateTimeout) || s.drives(0) == OperatingState::kFault);
  EXPECT_EQ(s.control.faultRecord(0).cause, safety::FaultCause::kSilent);
}

TEST(ControlCore, StopsWhenItsCommandsAreNoLongerTaken) {
  System s;
  s.getMoving();
  s.command_link = false;
  const double seconds = s.until([&] { return s.control.faultRecord(0).faults != 0; }, 2.0);
  EXPECT_GE(seconds, 0.0);
  EXPECT_LE(seconds, 0.3 + 0.2);
  // Depends on which detects it first: the drives report command_timeout, control reports unanswered commands.
  EXPECT_TRUE(s.control.faultRecord(0).cause == safety::FaultCause::kUnanswered ||
              s.state.faults[0] == bit(Fault::kCommandTimeout));
}

TEST(ControlCore, StopsWhenTheCommanderFallsSilent) {
  System s;
  s.getMoving();
  const double seconds = s.until([&] { return faulted(s, Fault::kLeaseLost); }, 3.0);
  EXPECT_GE(seconds, 0.0);
  EXPECT_LE(seconds, 1.0 + 0.2);
  s.run(0.5);
  EXPECT_TRUE(s.standing());
}

TEST(ControlCore, StopsByItselfWhereTheDrivesDoNotReceiveTheStop) {
  System s;
  s.getMoving();
  s.control.stop();
  s.run(0.5);
  EXPECT_TRUE(s.standing());
  EXPECT_TRUE(faulted(s, Fault::kStopRequested));
  EXPECT_NE(s.drives(0), OperatingState::kEnabled);
}

TEST(ControlCore, StopLatchesAndOnlyDisableClearsIt) {
  System s;
  s.getMoving();
  s.sim.onStop();
  s.control.stop();
  s.run(0.3);
  EXPECT_TRUE(s.standing());
  EXPECT_TRUE(faulted(s, Fault::kStopRequested));
  EXPECT_EQ(s.command(StateCommand::kEnable).refusal.code(), dds::ReplyCode::kWrongState);
  EXPECT_EQ(s.command(StateCommand::kResume).refusal.code(), dds::ReplyCode::kWrongState);
  s.sendRequest(ControlKind::kKeepLease);
  constexpr std::uint64_t kStranger = 8;
  EXPECT_EQ(s.command(StateCommand::kDisable, kStranger).refusal.code(), dds::ReplyCode::kNotLeaseOwner);
  s.run(0.3);
  EXPECT_TRUE(faulted(s, Fault::kStopRequested)) << "only the commander clears it";
  EXPECT_NE(s.drives(0), OperatingState::kEnabled);
  EXPECT_EQ(s.command(StateCommand::kDisable).refusal.code(), dds::ReplyCode::kOk);
  s.run(0.3);
  EXPECT_EQ(s.shown(0), OperatingState::kDisabled);
  EXPECT_EQ(s.output.status.faults[0], 0u);
  const auto there = s.state.position;
  s.sendRequest(ControlKind::kAcquireLease);
  EXPECT_EQ(s.command(StateCommand::kEnable).refusal.code(), dds::ReplyCode::kOk);
  s.run(0.3);
  EXPECT_EQ(s.shown(0), OperatingState::kEnabled);
  EXPECT_EQ(s.sendRequest(ControlKind::kKeepLease).refusal.code(), dds::ReplyCode::kOk);
  s.run(0.5);
  EXPECT_EQ(s.state.position, there);  // the previous trajectory has ended
  EXPECT_EQ(s.reference_message.phase, static_cast<std::uint8_t>(planning::Phase::kFailed));
}

TEST(ControlCore, PauseHoldsAndResumeGoesOn) {
  System s;
  s.getMoving();
  EXPECT_EQ(s.command(StateCommand::kPause).refusal.code(), dds::ReplyCode::kOk);
  s.run(0.4);
  EXPECT_TRUE(s.standing());
  EXPECT_EQ(s.shown(0), OperatingState::kPaused);
  const auto there = s.state.position;
  s.sendRequest(ControlKind::kKeepLease);
  s.run(0.5);
  EXPECT_EQ(s.state.position, there);
  s.sendRequest(ControlKind::kKeepLease);
  EXPECT_EQ(s.command(StateCommand::kResume).refusal.code(), dds::ReplyCode::kOk);
  s.run(0.6);
  EXPECT_NE(s.state.position, there);
}

TEST(ControlCore, MoveJpArrivesExactlyAndRefusesGoalsOutside) {
  System s;
  s.run(0.3);
  s.sendRequest(ControlKind::kAcquireLease);
  s.command(StateCommand::kEnable);
  s.run(0.3);
  operation::ParsedControlRequest move;
  move.client = 7;
  move.request = 3;
  move.kind = ControlKind::kMoveJp;
  move.arm = 0;
  move.joint_count = 6;
  std::copy_n(s.state.position.begin(), 6, move.joints.begin());
  move.joints[0] += 0.2;  // past the entry
  EXPECT_EQ(s.control.onRequest(move, s.now).refusal.code(), dds::ReplyCode::kOutsideLimits);
  move.joints[0] -= 0.2;
  operation::ParsedControlRequest outside = move;
  outside.joints[2] = s.model.limits()[0]->joints[2].upper + 1.23e-3;
  EXPECT_EQ(describe(s.control.onRequest(outside, s.now).refusal, s.setup.robot),
            "arm_a: the goal is outside the limits of the arm: there beta_3 is 1.23 mm outside");
  for (int j : {0, 1, 2})
    move.joints[static_cast<std::size_t>(j)] -= 0.004;
  move.joints[4] += 0.3;
  ASSERT_EQ(s.control.onRequest(move, s.now).refusal.code(), dds::ReplyCode::kOk);
  const double seconds = s.until(
      [&] {
        if (s.ticks % 200 == 0)
          s.sendRequest(ControlKind::kKeepLease);
        return s.ticks > 0 && s.output.status.busy[0] == 0 && s.standing() &&
               std::abs(s.state.position[0] - move.joints[0]) < 1e-9;
      },
      20.0);
  EXPECT_GT(seconds, 0.5);
  for (std::size_t j = 0; j < 6; ++j)
    EXPECT_NEAR(s.state.position[j], move.joints[j], 1e-9);
}

TEST(ControlCore, ARestartedRobotDoesNotMoveByItself) {
  System s;
  s.getMoving();
  runtime::Setup again = s.setup;
  again.session = s.setup.session + 1;
  simulation::SimCore fresh(again);
  dds::ActuationState state;
  fresh.state(s.now, state);
  s.control.onState(state);
  s.state_link = false;
  s.control.cycle(s.now, false, s.output);
  EXPECT_EQ(s.shown(0), OperatingState::kFault);
  EXPECT_EQ(s.control.faultRecord(0).cause, safety::FaultCause::kRestarted);
  for (std::size_t k = 0; k < 2; ++k)
    EXPECT_EQ(s.output.command.moving[k], 0);
}

TEST(ControlCore, MethodsChangeOnlyWhileNothingIsFollowed) {
  System s;
  s.getMoving();
  dds::ControlRequest request;
  request.client = 7;
  request.request = 9;
  request.kind = static_cast<std::uint8_t>(ControlKind::kSetMethod);
  request.text = "snsqp";
  dds::Reply refusal;
  auto parsed = s.handler.parse(request, 7, refusal);
  ASSERT_TRUE(parsed);
  EXPECT_EQ(s.handler.replyTo(s.control.onRequest(*parsed, s.now)).accepted, 0);
  dds::PlanningRequest stop;
  stop.client = 7;
  stop.kind = 4;
  std::optional<dds::Path> path;
  s.planning.onRequest(stop, path);
  s.run(0.3);
  s.sendRequest(ControlKind::kKeepLease);
  parsed = s.handler.parse(request, 7, refusal);
  ASSERT_TRUE(parsed);
  EXPECT_EQ(s.handler.replyTo(s.control.onRequest(*parsed, s.now)).accepted, 1);
  s.run(0.2);
  EXPECT_EQ(s.output.status.method, static_cast<std::uint8_t>(control::Method::kSnsqp));
  request.text = "newton";
  EXPECT_FALSE(s.handler.parse(request, 7, refusal));
  EXPECT_NE(refusal.reason.find("newton"), std::string::npos);
  // Nothing is prepared for other clients, whatever they request.
  for (const std::uint64_t owner : {0, 8}) {
    EXPECT_FALSE(s.handler.parse(request, owner, refusal));
    EXPECT_EQ(refusal.code, static_cast<std::uint8_t>(dds::ReplyCode::kNotLeaseOwner));
  }
}

TEST(ControlCore, NamesActiveLimits) {
  const struct {
    Change method;
    bool relative;  ///< the first task is unreachable, not the last
    dds::Limited limited;
  } cases[] = {
      {[](config::Deployment& d) { d.method = control::Method::kNspqp; }, false, dds::Limited::kHeldBack},
      {[](config::Deployment& d) { d.method = control::Method::kNspqp; }, true, dds::Limited::kForbidden},
      {[](config::Deployment& d) { d.method = control::Method::kSnsqp; }, false, dds::Limited::kHeldBack},
  };
  for (const auto& [method, relative, limited] : cases) {
    System s("laptop", method);
    s.run(0.3);
    s.sendRequest(ControlKind::kAcquireLease);
    s.command(StateCommand::kEnable);
    s.run(0.3);
    s.sendRequest(ControlKind::kKeepLease);
    planning::TrajectorySpec spec;
    spec.name = "far";
    spec.shape = planning::Line{{0.0, 0.0, relative ? 0.001 : 0.5}};
    if (relative)
      spec.relative.push_back(planning::Line{{0.0, 0.0, 0.5}});
    spec.point_count = 1;
    ASSERT_EQ(s.start(spec).accepted, 1);
    const double seconds = s.until([&] { return s.output.status.limited != 0; }, 0.8);
    ASSERT_GE(seconds, 0.0);
    const dds::ControlStatus& status = s.output.status;
    EXPECT_EQ(static_cast<dds::Limited>(status.limited), limited);
    ASSERT_GT(status.limit_count, 0);
    for (std::size_t i = 0; i < status.limit_count; ++i) {
      EXPECT_LT(status.limit_arm[i], 2);
      EXPECT_GE(status.limit_tube[i], 1);
      EXPECT_LE(status.limit_tube[i], 3);
      const control::NamedLimit limit{static_cast<control::LimitKind>(status.limit_kind[i]), status.limit_arm[i],
                                      status.limit_tube[i]};
      EXPECT_NE(control::describe(limit, {"a", "b"}).find("tube"), std::string::npos);
      if (limit.kind == control::LimitKind::kVelocity) {
        EXPECT_NEAR(std::abs(status.limit_bound[i]),
                    s.setup.robot.arms[0].limits.joints[static_cast<std::size_t>(limit.tube - 1)].velocity, 1e-12);
      }
    }
  }
}

TEST(ControlCore, ThePeriodicPathAllocatesNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  for (int m = 0; m < control::kMethodCount; ++m) {
    const auto method = static_cast<control::Method>(m);
    System s("laptop-1khz");
    s.setup.deployment.method = method;
    control_service::ControlRequestHandler handler(s.setup, s.model);
    operation::ControlCore control(control_service::controlSetupOf(s.setup, s.model), handler.makeTracker());
    s.getMoving();
    const dds::ActuationState state = s.state;
    dds::PlanningReference reference = s.reference_message;
    ASSERT_GT(reference.task_count, 0);
    // The same state for control with each method: enabled, following.
    operation::ParsedControlRequest parsed;
    parsed.client = 7;
    parsed.kind = ControlKind::kAcquireLease;
    operation::CycleOutput output;
    control.onState(state);
    control.cycle(s.now, false, output);
    parsed.control_session = output.status.session;
    parsed.answers_control = output.status.sequence;
    control.onRequest(parsed, s.now);
    parsed.kind = ControlKind::kStateCommand;
    parsed.command = StateCommand::kEnable;
    ASSERT_EQ(control.onRequest(parsed, s.now).refusal.code(), dds::ReplyCode::kOk);
    std::size_t allocated = 0;
    for (int i = 0; i < 200; ++i) {
      dds::ActuationState next = state;
      next.sequence += static_cast<std::uint64_t>(i);
      next.answers_command = reference.answers_control = static_cast<std::uint64_t>(i) + 1;
      reference.posture_valid = i >= 50 ? 1 : 0;
      reference.posture = state.position;
      // Out of reach: limits first restrict the tasks, then make them infeasible, and are reported.
      if (i == 100 || i == 150)
        reference.tasks[i == 100 ? 1 : 0].position[2] += 1.0;
      const std::size_t before = allocationCount();
      control.onState(next);
      control.onReference(reference);
      control.cycle(s.now + i * 1'000'000, false, output);
      s.sim.step(s.now + i * 1'000'000);
      s.sim.state(s.now + i * 1'000'000, s.state);
      s.sim.onCommand(output.command, s.now + i * 1'000'000);
      allocated += allocationCount() - before;
    }
    EXPECT_EQ(allocated, 0u) << control::name(method);
    EXPECT_GT(output.status.task_count, 0) << control::name(method);  // it did follow
    const bool names_limits = method >= control::Method::kNspqp;
    EXPECT_EQ(output.status.limit_count > 0, names_limits) << control::name(method);
  }
}

}  // namespace
}  // namespace tandem::test
