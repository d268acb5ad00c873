// SPDX-License-Identifier: Apache-2.0
/** @file Control at 1 kHz on a busy machine: states arrive late and in bursts, commands are lost. */
#include <gtest/gtest.h>

#include "tests/unit/safety/random_arm.h"
#include "tests/unit/services/system.h"

namespace tandem::test {
namespace {

/// Wide budgets: function is tested here, not time-outs.
void patient(config::Deployment& deployment) {
  deployment.budgets.minimum_age = 0.5;
  deployment.budgets.planning_reference = 1.0;
  deployment.budgets.lease = 2.0;
}

/// Largest commanded speed of a joint.
double fastest(const dds::ActuationCommand& command) {
  double speed = 0.0;
  for (const double v : command.velocity)
    speed = std::max(speed, std::abs(v));
  return speed;
}

/** Cuts the links at random times, each for a while. */
class Disturber {
 public:
  explicit Disturber(std::uint32_t seed) : random_(seed) {}

  void tick(System& s) {
    s.state_link = open(state_cut_);
    s.command_link = open(command_cut_);
  }

 private:
  bool open(int& cut) {
    if (cut == 0 && random_.chance(0.01))
      cut = random_.chance(0.5) ? random_.integer(1, 3) : random_.integer(20, 150);  // ms
    return cut == 0 || --cut == 0;
  }
  Random random_;
  int state_cut_ = 0, command_cut_ = 0;
};

bool finished(const System& s) {
  return s.reference_message.phase == static_cast<std::uint8_t>(planning::Phase::kFinished);
}

TEST(LossyLinks, TheReferenceNeverMovesFasterThanControlAsks) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 5; ++seed) {
    SCOPED_TRACE(trace(seed));
    System s("laptop-1khz", patient);
    s.getMoving();
    ASSERT_FALSE(s.standing());
    Disturber disturber(seed);
    double asked = fastest(s.output.command);
    auto last = s.state.setpoint;
    int ticks = 0;
    for (; ticks < 30000 && !finished(s); ++ticks) {
      disturber.tick(s);
      s.tick();
      if (ticks % 200 == 0)
        s.sendRequest(dds::ControlKind::kKeepLease);
      asked = std::max(asked, fastest(s.output.command));
      for (std::size_t j = 0; j < last.size(); ++j)
        ASSERT_LE(std::abs(s.state.setpoint[j] - last[j]), 1e-3 * asked * (1 + 1e-6)) << "joint " << j << ", " << ticks;
      last = s.state.setpoint;
      ASSERT_EQ(s.state.faults[0] | s.state.faults[1], 0u)
          << safety::describe(s.sim.faultRecord(0)) << "; " << safety::describe(s.sim.faultRecord(1));
    }
    EXPECT_TRUE(finished(s)) << ticks;
    EXPECT_EQ(s.guardActions(), 0u);
    EXPECT_EQ(s.output.status.faults[0], 0u);
  }
}

/// Starts a motion of arm A. @return the goal
std::array<double, 6> startMotion(System& s) {
  s.run(0.3);
  s.sendRequest(dds::ControlKind::kAcquireLease);
  s.command(safety::StateCommand::kEnable);
  s.run(0.3);
  operation::ParsedControlRequest move;
  move.client = 7;
  move.kind = dds::ControlKind::kMoveJp;
  move.arm = 0;
  move.joint_count = 6;
  std::copy_n(s.state.position.begin(), 6, move.joints.begin());
  for (std::size_t j = 0; j < 3; ++j)
    move.joints[j] -= 0.004;
  move.joints[4] += 0.3;
  EXPECT_EQ(s.control.onRequest(move, s.now).refusal.code(), dds::ReplyCode::kOk);
  std::array<double, 6> goal;
  std::copy_n(move.joints.begin(), 6, goal.begin());
  return goal;
}

void expectArrived(const System& s, const std::array<double, 6>& goal) {
  EXPECT_TRUE(s.standing());
  for (std::size_t j = 0; j < goal.size(); ++j)
    EXPECT_NEAR(s.state.position[j], goal[j], 1e-6);
  EXPECT_EQ(s.guardActions(), 0u);
  EXPECT_EQ(s.output.status.faults[0], 0u) << safety::describe(s.control.faultRecord(0));
}

TEST(LossyLinks, AMotionArrivesAlthoughItsCommandsAreLate) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 50; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    System s("laptop", patient);
    const auto goal = startMotion(s);
    for (int i = 0; i < 10000 && (i < 200 || s.output.status.busy[0] != 0 || !s.standing()); ++i) {
      if (i % 100 == 0)
        s.command_delay = random.integer(0, 5);
      s.tick();
      if (i % 200 == 0)
        s.sendRequest(dds::ControlKind::kKeepLease);
    }
    expectArrived(s, goal);
  }
}

/// Default budgets, control at 100 Hz, states at 1 kHz.
void atHundredHertz(config::Deployment& deployment) { deployment.control_period = 0.01; }

/// Moves an arm, losing each sample of one link with this probability. @return s until arm A is in FAULT; below 0: it
/// is not
double lose(System& s, bool System::*link, double chance, Random& random) {
  startMotion(s);
  int ticks = 0;
  const double time = s.until(
      [&] {
        // Three missing cycles would exceed the age: never two commands in a row.
        if (link == &System::state_link || s.ticks % 10 == 0)
          s.*link = (link == &System::command_link && !(s.*link)) || !random.chance(chance);
        if (++ticks % 200 == 0)
          s.sendRequest(dds::ControlKind::kKeepLease);
        return s.drives(0) == safety::OperatingState::kFault || s.shown(0) == safety::OperatingState::kFault;
      },
      5.0);
  s.*link = true;
  s.run(0.5);
  return time;
}

TEST(LossyLinks, StopAnArmWhoseCommandsAreLostNowAndThen) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 10; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    System s("laptop", atHundredHertz);
    const double time = lose(s, &System::command_link, 0.15, random);
    ASSERT_GE(time, 0.0) << "it goes on";
    EXPECT_LE(time, 2.0);
    const safety::FaultRecord& record = s.sim.faultRecord(0);
    EXPECT_EQ(record.faults, bit(safety::Fault::kCommandTimeout)) << safety::describe(record);
    EXPECT_EQ(safety::describe(record),
              "command_timeout (too many samples lost): 0.06 of the last 100, allowed 0.05 of the last 100");
    EXPECT_TRUE(s.standing());
    // Losses from before the arm was enabled again stop nothing.
    s.sendRequest(dds::ControlKind::kAcquireLease);
    s.command(safety::StateCommand::kDisable);
    s.run(0.2);
    s.sendRequest(dds::ControlKind::kKeepLease);
    s.command(safety::StateCommand::kEnable);
    s.run(0.2);
    EXPECT_EQ(s.drives(0), safety::OperatingState::kEnabled) << safety::describe(s.sim.faultRecord(0));
    EXPECT_LT(s.hal.command_success, 1.0) << "it is still reported";
  }
}

TEST(LossyLinks, StopAnArmWhoseStatesAreLostNowAndThen) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 10; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    System s("laptop", atHundredHertz);
    const double time = lose(s, &System::state_link, 0.6, random);
    ASSERT_GE(time, 0.0) << "it goes on";
    EXPECT_LE(time, 1.0);
    EXPECT_EQ(s.control.faultRecord(0).cause, safety::FaultCause::kLost) << safety::describe(s.control.faultRecord(0));
    EXPECT_TRUE(s.standing());
  }
}

TEST(LossyLinks, FewLossesAreReportedOnly) {
  System s("laptop", atHundredHertz);
  const auto goal = startMotion(s);
  double worst = 1.0;
  for (int i = 0; i < 10000 && (i < 200 || s.output.status.busy[0] != 0 || !s.standing()); ++i) {
    s.command_link = s.ticks / 10 % 30 != 0;  // one in thirty
    s.tick();
    worst = std::min(worst, s.hal.command_success);
    if (i % 200 == 0)
      s.sendRequest(dds::ControlKind::kKeepLease);
  }
  expectArrived(s, goal);
  EXPECT_LT(worst, 0.98);
  EXPECT_GT(worst, 0.95);
}

TEST(LossyLinks, ATrajectoryGoesOnWherePlanningIsFarAway) {
  for (const std::int64_t delay : {1, 5, 25}) {
    SCOPED_TRACE(delay);
    System s("laptop-1khz", patient);
    s.planning_delay = delay;
    s.getMoving();
    planning::TrajectorySpec spec;
    spec.name = "points";
    spec.shape = planning::Line{{0.0, 0.004, 0.0}};
    spec.point_count = 5;
    dds::PlanningRequest stop;
    stop.client = 7;
    stop.kind = 4;
    std::optional<dds::Path> path;
    ASSERT_EQ(s.planning.onRequest(stop, path).accepted, 1);
    ASSERT_EQ(s.start(spec).accepted, 1);
    for (int i = 0; i < 30000 && !finished(s); ++i) {
      s.tick();
      if (i % 200 == 0)
        s.sendRequest(dds::ControlKind::kKeepLease);
    }
    EXPECT_TRUE(finished(s)) << "point " << s.reference_message.point;
    EXPECT_EQ(s.output.status.faults[0], 0u) << safety::describe(s.control.faultRecord(0));
  }
}

TEST(LossyLinks, AMotionArrivesExactlyAndWithinItsLimits) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 20; ++seed) {
    SCOPED_TRACE(trace(seed));
    System s("laptop-1khz", patient);
    const auto goal = startMotion(s);
    Disturber disturber(seed);
    auto last = s.state.setpoint;
    for (int i = 0; i < 10000 && (i < 10 || s.output.status.busy[0] != 0 || !s.standing()); ++i) {
      disturber.tick(s);
      s.tick();
      if (i % 200 == 0)
        s.sendRequest(dds::ControlKind::kKeepLease);
      for (std::size_t j = 0; j < last.size(); ++j)
        ASSERT_LE(std::abs(s.state.setpoint[j] - last[j]), 1e-3 * (j < 3 ? 5e-3 : 0.5) * (1 + 1e-6))
            << "joint " << j << ", " << i;
      last = s.state.setpoint;
    }
    expectArrived(s, goal);
  }
}

/** A client behind a link that delays its lease requests, one every 0.1 s. */
class DelayedClient {
 public:
  DelayedClient(System& system, double delay) : system_(system), delay_(std::llround(1e9 * delay)) {}

  /// Before each tick.
  void tick(bool sends, dds::ControlKind kind = dds::ControlKind::kKeepLease) {
    if (sends && system_.ticks % 100 == 0)
      link_.emplace_back(system_.now + delay_, system_.requestOf(kind));
    while (!link_.empty() && link_.front().first <= system_.now) {
      system_.control.onRequest(link_.front().second, system_.now);
      link_.pop_front();
    }
  }

 private:
  System& system_;
  std::int64_t delay_;
  std::deque<std::pair<std::int64_t, operation::ParsedControlRequest>> link_;
};

bool lostItsLease(const System& s) { return (s.output.status.faults[0] & bit(safety::Fault::kLeaseLost)) != 0; }

/// A link that delays messages goes on delivering heartbeats of a client that is gone.
TEST(LossyLinks, HeartbeatsUnderWayDoNotKeepTheLease) {
  System s;
  s.getMoving();
  DelayedClient client(s, 0.7);
  for (int i = 0; i < 3000; ++i) {
    client.tick(true);
    if (i < 700 && i % 100 == 0)
      s.sendRequest(dds::ControlKind::kKeepLease);
    s.tick();
  }
  ASSERT_FALSE(s.standing()) << "a delay shorter than the lease keeps it";
  const double seconds = s.until([&] { return client.tick(false), lostItsLease(s); }, 4.0);
  EXPECT_GE(seconds, 0.0);
  EXPECT_LE(seconds, 1.0 + 0.2) << "the age of a heartbeat counts from the status that it answers";
}

TEST(LossyLinks, RequestsOlderThanTheLeaseNeitherKeepNorAcquireIt) {
  System s;
  s.getMoving();
  DelayedClient client(s, 1.5);
  const double seconds = s.until([&] { return client.tick(true), lostItsLease(s); }, 4.0);
  EXPECT_GE(seconds, 0.0);
  EXPECT_LE(seconds, 1.0 + 0.2);
  for (int i = 0; i < 3000; ++i) {
    client.tick(true, dds::ControlKind::kAcquireLease);
    s.tick();
    ASSERT_EQ(s.output.status.lease_owner, 0u);
  }
  auto to_another = s.requestOf(dds::ControlKind::kAcquireLease);
  ++to_another.control_session;
  EXPECT_EQ(s.control.onRequest(to_another, s.now).refusal.reason, operation::Reason::kOtherControl);
  EXPECT_EQ(s.sendRequest(dds::ControlKind::kAcquireLease).refusal.reason, operation::Reason::kNone);
}

}  // namespace
}  // namespace tandem::test
