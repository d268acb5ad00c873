// SPDX-License-Identifier: Apache-2.0
/** @file Control in closed loop with measured tips. */
#include <gtest/gtest.h>

#include "operation/convert.h"
#include "tests/unit/safety/allocation_counter.h"
#include "tests/unit/services/system.h"

namespace tandem::test {
namespace {

using dds::HoldReason;
using planning::Phase;

void withSensor(config::Deployment& deployment) {
  deployment.plant.model = "compliant";
  deployment.plant.tracker.present = true;
  deployment.feedback = planning::Feedback::kSensor;
}

HoldReason holdOf(const System& s) { return static_cast<HoldReason>(s.output.status.hold); }

double untilFinished(System& s) {
  return s.until(
      [&] {
        if (s.ticks % 200 == 0)
          s.sendRequest(dds::ControlKind::kKeepLease);
        return s.reference_message.phase >= static_cast<std::uint8_t>(Phase::kFinished);
      },
      30.0);
}

TEST(SensorFeedback, FollowsOnAPlantThatTheModelDoesNotKnow) {
  System s("laptop", withSensor);
  s.getMoving();
  EXPECT_EQ(s.output.status.feedback, 1);
  EXPECT_EQ(s.output.status.model, 0);
  EXPECT_GT(untilFinished(s), 0.0);
  EXPECT_EQ(s.reference_message.phase, static_cast<std::uint8_t>(Phase::kFinished));
  EXPECT_EQ(holdOf(s), HoldReason::kNone);
  EXPECT_EQ(s.output.status.faults[0], 0u);
}

TEST(SensorFeedback, StaleTipsHoldTheTrajectoryAndFreshOnesLetItGoOn) {
  System s("laptop", withSensor);
  s.getMoving();
  ASSERT_FALSE(s.standing());
  ASSERT_EQ(holdOf(s), HoldReason::kNone);
  s.tips_link = false;
  const double held = s.until([&] { return holdOf(s) == HoldReason::kStaleTips; }, 2.0);
  const double budget = s.setup.deployment.budgets.tipAge(s.setup.deployment.control_period);
  EXPECT_GT(held, budget - 0.2);
  EXPECT_LT(held, budget + 0.2) << "a period to notice, one for the command that the measurement answered";
  EXPECT_GT(s.output.status.tip_age, budget);
  s.sendRequest(dds::ControlKind::kKeepLease);
  EXPECT_GE(s.until([&] { return s.standing(); }, 0.5), 0.0);
  const auto there = s.state.position;
  const std::uint32_t iteration = s.reference_message.total_iterations;
  for (int i = 0; i < 4; ++i) {
    s.sendRequest(dds::ControlKind::kKeepLease);
    s.run(0.5);
  }
  EXPECT_EQ(s.state.position, there);
  EXPECT_EQ(s.reference_message.total_iterations, iteration) << "the reference does not run away";
  EXPECT_EQ(s.shown(0), safety::OperatingState::kEnabled) << "a hold is no fault";
  s.tips_link = true;
  EXPECT_GT(untilFinished(s), 0.0);
  EXPECT_EQ(s.reference_message.phase, static_cast<std::uint8_t>(Phase::kFinished));
}

TEST(SensorFeedback, InvalidTipsHoldThePathAndAreReported) {
  System s("laptop", [](config::Deployment& deployment) {
    withSensor(deployment);
    deployment.plant.tracker.drop_out = 1.0;
  });
  // Only the measurement of the robot at the start of the simulator is valid.
  s.sim.measuredTips(s.tips);
  s.control.onTips(s.tips);
  s.planning.onTips(s.tips);
  s.run(0.3);
  s.sendRequest(dds::ControlKind::kAcquireLease);
  s.command(safety::StateCommand::kEnable);
  s.run(0.3);
  planning::TrajectorySpec spec;
  spec.name = "line";
  spec.shape = planning::Line{{0.0, 0.02, 0.0}};
  ASSERT_EQ(s.start(spec).accepted, 1) << "the tips at the start are known";
  s.sendRequest(dds::ControlKind::kKeepLease);
  s.run(0.6);
  EXPECT_EQ(holdOf(s), HoldReason::kInvalidTips);
  EXPECT_TRUE(s.standing());
}

TEST(SensorFeedback, WithoutTipsNoTrajectoryStarts) {
  System s("laptop", withSensor);
  s.tips_link = false;
  s.run(0.3);
  s.sendRequest(dds::ControlKind::kAcquireLease);
  s.command(safety::StateCommand::kEnable);
  s.run(0.3);
  planning::TrajectorySpec spec;
  spec.name = "line";
  spec.shape = planning::Line{{0.0, 0.02, 0.0}};
  EXPECT_EQ(s.start(spec).accepted, 0);
}

TEST(SimCorePlant, SnapsAreCountedInHalStatus) {
  const runtime::Setup setup =
      makeSetup("lockstep", [](config::Deployment& deployment) { deployment.plant.model = "compliant"; });
  simulation::SimCore sim(setup);
  dds::SimRequest reset;
  reset.kind = 1;
  reset.arm_count = 2;
  const double beta[] = {-0.24, -0.13, -0.02};
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 3; ++j)
      reset.joints[dds::jointIndex(k, j)] = beta[j];
  }
  ASSERT_EQ(sim.onRequest(reset).accepted, 1);
  dds::ActuationState state;
  dds::HalStatus status;
  dds::ActuationCommand command;
  command.control_session = 5;
  command.state_session = setup.session;
  command.arm_count = 2;
  const auto send = [&] {
    sim.state(0, state);
    ++command.sequence;
    command.answers_state = state.sequence;
    sim.onCommand(command, 0);
  };
  command.request.fill(static_cast<std::uint8_t>(safety::DriveRequest::kEnable));
  send();
  command.request.fill(0);
  command.moving.fill(1);
  command.advance = 1;
  command.velocity[dds::jointIndex(0, 3)] = 0.2;  // tube 1 of arm_a rotates, the others do not move
  for (int i = 0; i < 500; ++i)                   // ten radians
    send();
  sim.state(0, state);
  sim.status(status);
  EXPECT_GT(state.position[dds::jointIndex(0, 3)], 9.0);
  EXPECT_EQ(state.joint_resets, 1u);
  EXPECT_GE(status.snaps[0], 1u);
  EXPECT_EQ(status.snaps[1], 0u) << "arm_b stands";
}

TEST(SimCorePlant, TipsAllocateNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  System s("laptop", [](config::Deployment& deployment) {
    withSensor(deployment);
    deployment.plant.model = "rigid";
  });
  s.getMoving();
  dds::TipPoses measured, real;
  const std::size_t before = allocationCount();
  for (int i = 0; i < 100; ++i) {
    s.now += 1'000'000;
    s.sim.step(s.now);
    s.sim.measuredTips(measured);
    s.sim.trueTips(real);
    s.control.onTips(measured);
    s.control.cycle(s.now, false, s.output);
  }
  EXPECT_EQ(allocationCount(), before);
  EXPECT_EQ(real.valid[0], 1);
}

}  // namespace
}  // namespace tandem::test
