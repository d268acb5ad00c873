// SPDX-License-Identifier: Apache-2.0
/** @file Simulated robot on a loaded machine. */
#include <gtest/gtest.h>

#include "operation/convert.h"
#include "tests/unit/safety/random_arm.h"
#include "tests/unit/services/system.h"

namespace tandem::test {
namespace {

constexpr std::int64_t kTick = 1'000'000;

/// One simulator called every period, and one that is sometimes delayed; both receive the same commands.
struct Pair {
  Pair() : setup(makeSetup("laptop")), punctual(setup), sleepy(setup) {}

  void command(simulation::SimCore& sim, double velocity, std::uint8_t request) {
    dds::ActuationState state;
    sim.state(now, state);
    dds::ActuationCommand command;
    command.control_session = 5;
    command.sequence = sequence;
    command.state_session = setup.session;
    command.answers_state = state.sequence;
    command.arm_count = 2;
    command.request.fill(request);
    command.moving.fill(request == 0 ? 1 : 0);
    command.velocity[dds::jointIndex(0, 2)] = command.velocity[dds::jointIndex(1, 5)] = velocity;
    sim.onCommand(command, now);
  }
  void commandBoth(double velocity, std::uint8_t request = 0) {
    ++sequence;
    command(punctual, velocity, request);
    command(sleepy, velocity, request);
  }
  dds::ActuationState stateOf(simulation::SimCore& sim) {
    dds::ActuationState state;
    sim.state(now, state);
    return state;
  }

  runtime::Setup setup;
  simulation::SimCore punctual, sleepy;
  std::int64_t now = 1'000'000'000;
  std::uint64_t sequence = 0;
};

TEST(SimCore, MissedPeriodsAreCaughtUp) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 20; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Pair pair;
    std::uint64_t slept = 0;
    pair.commandBoth(0.0, static_cast<std::uint8_t>(safety::DriveRequest::kEnable));
    for (int i = 0; i < 30; ++i) {
      pair.commandBoth(random.uniform(-4e-3, 4e-3));
      const int sleep = random.integer(0, 90);
      for (int k = 0; k < 100; ++k) {
        pair.now += kTick;
        pair.punctual.step(pair.now);
        if (k == sleep && sleep > 0) {
          pair.sleepy.catchUp(static_cast<std::uint64_t>(sleep), pair.now - kTick);
          slept += static_cast<std::uint64_t>(sleep);
        }
        if (k >= sleep)
          pair.sleepy.step(pair.now);
      }
      const dds::ActuationState a = pair.stateOf(pair.punctual), b = pair.stateOf(pair.sleepy);
      ASSERT_EQ(a.position, b.position) << i;
      ASSERT_EQ(a.setpoint, b.setpoint);
      ASSERT_EQ(a.operating_state, b.operating_state);
    }
    EXPECT_NE(pair.stateOf(pair.punctual).position[2], pair.setup.robot.arms[0].home[2]);
    dds::HalStatus status;
    pair.sleepy.status(status);
    EXPECT_EQ(status.caught_up, slept);
    EXPECT_EQ(status.left_out, 0u);
  }
}

TEST(SimCore, AfterALongSleepTheArmsStandAndTheRestIsLeftOut) {
  Pair pair;
  pair.commandBoth(0.0, static_cast<std::uint8_t>(safety::DriveRequest::kEnable));
  pair.commandBoth(4e-3);
  pair.now += 10'000 * kTick;
  pair.sleepy.catchUp(10'000, pair.now);
  const dds::ActuationState state = pair.stateOf(pair.sleepy);
  EXPECT_EQ(state.operating_state[0], static_cast<std::uint8_t>(safety::OperatingState::kFault));
  EXPECT_EQ(state.faults[0], bit(safety::Fault::kCommandTimeout));
  EXPECT_EQ(pair.sleepy.faultRecord(0).faults, bit(safety::Fault::kCommandTimeout));
  for (const double velocity : state.velocity)
    EXPECT_EQ(velocity, 0.0);
  dds::HalStatus status;
  pair.sleepy.status(status);
  EXPECT_EQ(status.caught_up, 1000u);
  EXPECT_EQ(status.left_out, 9000u);
}

TEST(SimCore, PressesAndReleasesTheEmergencyStopOnRequest) {
  System s;
  s.getMoving();
  EXPECT_EQ(s.hal.emergency_stop, 1);
  dds::SimRequest request;
  request.kind = 3;
  request.fault = "emergency_stop";
  EXPECT_EQ(s.sim.onRequest(request).accepted, 1);
  s.run(0.3);
  EXPECT_EQ(s.hal.emergency_stop, 2);
  for (int arm : {0, 1})
    EXPECT_EQ(s.drives(arm), safety::OperatingState::kFault);
  EXPECT_EQ(dds::faultRecordOf(s.hal, 0).cause, safety::FaultCause::kEmergencyStop);
  // While the emergency stop is pressed `disable` clears nothing.
  s.sendRequest(dds::ControlKind::kAcquireLease);
  s.command(safety::StateCommand::kDisable);
  s.run(0.3);
  EXPECT_EQ(s.drives(0), safety::OperatingState::kFault);
  EXPECT_NE(s.command(safety::StateCommand::kEnable).refusal.code(), dds::ReplyCode::kOk);
  request.fault = "emergency_stop_released";
  EXPECT_EQ(s.sim.onRequest(request).accepted, 1);
  s.run(0.2);
  s.command(safety::StateCommand::kDisable);
  s.run(0.3);
  EXPECT_EQ(s.drives(0), safety::OperatingState::kDisabled);
  EXPECT_EQ(s.command(safety::StateCommand::kEnable).refusal.code(), dds::ReplyCode::kOk);
  s.run(0.3);
  EXPECT_EQ(s.drives(0), safety::OperatingState::kEnabled);
}

TEST(SimCore, ReportsOfTheEmergencyStopCountAndSoDoesTheirSilence) {
  System s("laptop", [](config::Deployment& deployment) { deployment.emergency_stop_budget = 0.2; });
  s.getMoving();
  EXPECT_EQ(s.drives(0), safety::OperatingState::kEnabled) << "nobody has ever reported";
  s.sim.onEmergencyStop(false, s.now);
  s.run(0.15);
  EXPECT_EQ(s.drives(0), safety::OperatingState::kEnabled);
  s.run(0.15);
  EXPECT_EQ(s.drives(0), safety::OperatingState::kFault) << "silent";
  EXPECT_EQ(s.hal.emergency_stop, 2);
  s.sim.onEmergencyStop(false, s.now);
  s.run(0.1);
  EXPECT_EQ(s.hal.emergency_stop, 1);
  s.sim.onEmergencyStop(true, s.now);
  s.run(0.01);
  EXPECT_EQ(s.hal.emergency_stop, 2);
}

}  // namespace
}  // namespace tandem::test
