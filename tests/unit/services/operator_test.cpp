// SPDX-License-Identifier: Apache-2.0
/** @file Operator input with control and the simulated robot, in simulated time. */
#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "operation/convert.h"
#include "tests/unit/safety/allocation_counter.h"
#include "tests/unit/services/system.h"

namespace tandem::test {
namespace {

using dds::ControlKind;
using planning::teleoperation::Mode;
using planning::teleoperation::State;
using safety::OperatingState;
using safety::StateCommand;

constexpr std::uint64_t kOperator = 7;

/// Control at 100 Hz: budgets are those of the table, not multiples of control periods.
void quick(config::Deployment& d) {
  d.control_period = 0.01;
  d.teleoperation.options.guard.leash = 1e-3;
}

/** A system with an operator who sends 100 times a second. */
struct Operated : System {
  explicit Operated(const std::string& deployment = "laptop", Change change = quick) : System(deployment, change) {
    input.client = kOperator;
    input.mode = static_cast<std::uint8_t>(Mode::kPair);
    input.arm = 0;
    input.other_arm = 1;
    input.kind = 1;
    input.device = 4;
  }

  void step() {
    if (sending && ticks % 10 == 0) {
      input.control_session = output.status.session;
      input.answers_control = output.status.sequence;
      ++input.sequence;
      control.onInput(input, now);
    }
    if (ticks % 200 == 0)
      sendRequest(ControlKind::kKeepLease, kOperator);
    tick();
    control.fillSnapshots(now, snapshot, crtk_snapshot);
  }
  void go(double seconds) {
    for (int i = 0; i < std::lround(1000 * seconds); ++i)
      step();
  }
  void expectStandstillWithin(
      double budget,
      const std::function<void()>& before_step = [] {}) {
    EXPECT_FALSE(standing());
    int steps = 0;
    for (; steps < 1000 && !standing(); ++steps, step())
      before_step();
    EXPECT_LE(1e-3 * steps, budget + 2 * 0.01 + 5e-3 / 0.1);  // two control periods and the ramp
  }
  void enable() {
    go(0.3);
    sendRequest(ControlKind::kAcquireLease, kOperator);
    command(StateCommand::kEnable, kOperator);
    go(0.3);
  }
  /// Enables, holds the switch, and moves.
  void drive(const Eigen::Vector3d& velocity) {
    enable();
    input.operator_present = 1;
    Eigen::Vector3d::Map(input.linear.data()) = velocity;
    go(0.5);
  }
  Eigen::Vector3d tip(int k) {
    kinematics::Tip found;
    const safety::ArmVector q = dds::jointsOf(state.position, k, model.size(k));
    EXPECT_EQ(model.models()[static_cast<std::size_t>(k)]->tip(q, found), kinematics::ModelStatus::kOk);
    return found.pose.translation();
  }
  Eigen::Vector3d relative() { return tip(0) - tip(1); }
  State operatorState() const { return snapshot.state; }
  dds::Source source() const { return static_cast<dds::Source>(output.status.source); }

  dds::TeleopInput input;
  operation::OperatorSnapshot snapshot;
  operation::CrtkSnapshot crtk_snapshot;
  bool sending = true;
};

TEST(Operator, DrivesATipWhileTheRelativePositionIsKept) {
  Operated s;
  s.enable();
  const Eigen::Vector3d start = s.tip(0), relative = s.relative();
  s.input.operator_present = 1;
  s.input.linear = {0.0, 0.008, 0.0};
  double worst = 0.0;
  for (int i = 0; i < 2000; ++i) {
    s.step();
    worst = std::max(worst, (s.relative() - relative).norm());
  }
  EXPECT_EQ(s.operatorState(), State::kFollowing);
  EXPECT_EQ(s.source(), dds::Source::kTeleoperation);
  const Eigen::Vector3d way = s.tip(0) - start;
  // Half of (8 mm/s minus the deadband), for 2 s, minus the lag of filter and tip.
  EXPECT_GT(way.y(), 6e-3);
  EXPECT_LT(way.y(), 7.6e-3);
  EXPECT_LT(std::hypot(way.x(), way.z()), 0.2e-3);
  EXPECT_LT(worst, 0.2e-3);
  EXPECT_EQ(s.guardActions(), 0u);
}

TEST(Operator, MovesTheRelativePositionWhileTheOtherTipStays) {
  Operated s;
  s.enable();
  const Eigen::Vector3d other = s.tip(1), relative = s.relative();
  s.input.mode = static_cast<std::uint8_t>(Mode::kRelative);
  s.input.operator_present = 1;
  s.input.linear = {0.0, 0.006, 0.0};
  s.go(2.0);
  EXPECT_GT((s.relative() - relative).y(), 4e-3);
  EXPECT_LT((s.tip(1) - other).norm(), 0.2e-3);
}

TEST(Operator, StopsWhenTheSwitchIsReleased) {
  Operated s;
  s.drive({0.0, 0.01, 0.0});
  s.input.operator_present = 0;
  s.expectStandstillWithin(0.01);  // one input
  EXPECT_EQ(s.operatorState(), State::kReleased);
  const auto there = s.state.position;
  s.go(0.5);
  EXPECT_EQ(s.state.position, there);
  EXPECT_EQ(s.shown(0), OperatingState::kEnabled);
}

TEST(Operator, StopsBothArmsWhenEitherIsPaused) {
  for (const int arm : {0, 1}) {
    Operated s;
    s.drive({0.0, 0.01, 0.0});
    s.command(StateCommand::kPause, 8, arm);  // anybody may pause
    s.expectStandstillWithin(0.0);
    EXPECT_EQ(s.snapshot.reason, operation::Reason::kNotEnabled) << "arm " << arm;
    EXPECT_EQ(s.shown(1 - arm), OperatingState::kEnabled);
  }
}

TEST(Operator, StopsWithinTheBudgetWhenTheStreamFallsSilent) {
  Operated s;
  s.drive({0.0, 0.01, 0.0});
  s.sending = false;
  s.expectStandstillWithin(0.1);
  EXPECT_EQ(s.snapshot.reason, operation::Reason::kSilent);
  // The input resumes with the switch held: nothing moves until it is released and held again.
  const auto there = s.state.position;
  s.sending = true;
  s.go(0.5);
  EXPECT_EQ(s.state.position, there);
  EXPECT_EQ(s.operatorState(), State::kStopped);
  s.input.operator_present = 0;
  s.go(0.1);
  s.input.operator_present = 1;
  s.go(0.3);
  EXPECT_EQ(s.operatorState(), State::kFollowing);
  EXPECT_NE(s.state.position, there);
}

TEST(Operator, OldInputsDoNotCountHoweverManyCome) {
  Operated s;
  s.drive({0.0, 0.01, 0.0});
  s.sending = false;
  s.expectStandstillWithin(0.1, [&] {
    if (s.ticks % 5 == 0) {  // as a network would deliver delayed samples
      ++s.input.sequence;
      s.control.onInput(s.input, s.now);
    }
  });
  EXPECT_GT(s.snapshot.late, 0u);
}

TEST(Operator, OneCommander) {
  Operated s;
  s.drive({0.0, 0.01, 0.0});
  dds::TeleopInput other = s.input;
  other.client = 8;
  other.linear = {0.0, -1.0, 0.0};
  const double before = s.tip(0).y();
  for (int i = 0; i < 500; ++i) {
    other.answers_control = s.output.status.sequence;
    ++other.sequence;
    s.control.onInput(other, s.now);
    s.step();
  }
  EXPECT_GT(s.tip(0).y(), before);
  EXPECT_EQ(s.operatorState(), State::kFollowing);
  EXPECT_EQ(s.snapshot.refused_client, 8u);
  EXPECT_EQ(s.snapshot.refusal, operation::Reason::kNotCommander);
}

TEST(Operator, ASwitchThatIsHeldFromTheStartDoesNotCount) {
  Operated s;
  s.input.operator_present = 1;
  s.input.linear = {0.0, 0.01, 0.0};
  s.enable();
  const auto there = s.state.position;
  s.go(0.5);
  EXPECT_EQ(s.state.position, there);
  EXPECT_EQ(s.operatorState(), State::kStopped);
  s.input.operator_present = 0;
  s.go(0.2);
  // The next operator holds it, too.
  s.sendRequest(ControlKind::kReleaseLease, kOperator);
  s.sendRequest(ControlKind::kAcquireLease, s.input.client = 8);
  s.input.operator_present = 1;
  s.go(0.4);
  EXPECT_EQ(s.state.position, there);
  EXPECT_EQ(s.operatorState(), State::kStopped);
}

TEST(Operator, NothingMovesByEnablingWhileTheSwitchIsHeld) {
  Operated s;
  s.go(0.3);
  s.sendRequest(ControlKind::kAcquireLease, kOperator);
  s.go(0.1);
  s.input.operator_present = 1;
  s.input.linear = {0.0, 0.01, 0.0};
  s.go(0.2);
  EXPECT_EQ(s.snapshot.reason, operation::Reason::kNotEnabled);
  s.command(StateCommand::kEnable, kOperator);
  const auto there = s.state.position;
  s.go(0.5);
  EXPECT_EQ(s.shown(0), OperatingState::kEnabled);
  EXPECT_EQ(s.state.position, there);
}

TEST(Operator, HandsOverFromAndToPlanningWithoutAJump) {
  Operated s("laptop", [](config::Deployment& d) { d.control_period = 0.02; });
  s.enable();
  planning::TrajectorySpec spec;
  spec.name = "line";
  spec.shape = planning::Line{{0.0, 0.02, 0.0}};
  spec.following = planning::Following::kTimed;
  ASSERT_EQ(s.start(spec).accepted, 1);
  s.go(1.0);
  ASSERT_EQ(s.source(), dds::Source::kPlanning);
  s.input.operator_present = 1;  // while it runs: refused
  s.input.linear = {0.0, 0.0, 0.0};
  s.go(0.2);
  EXPECT_EQ(s.source(), dds::Source::kPlanning);
  EXPECT_EQ(s.snapshot.reason, operation::Reason::kTrajectory);
  s.input.operator_present = 0;
  dds::PlanningRequest pause;
  pause.client = kOperator;
  pause.kind = 2;
  std::optional<dds::Path> path;
  ASSERT_EQ(s.planning.onRequest(pause, path).accepted, 1);
  s.go(1.0);
  s.input.operator_present = 1;
  const Eigen::Vector3d there = s.tip(0);
  s.go(0.5);
  EXPECT_EQ(s.source(), dds::Source::kTeleoperation);
  EXPECT_LT((s.tip(0) - there).norm(), 0.1e-3);
  EXPECT_EQ(s.start(spec).code, static_cast<std::uint16_t>(dds::ReplyCode::kBusy));
  s.input.linear = {0.0, -0.01, 0.0};
  s.go(1.0);
  s.input.operator_present = 0;
  s.go(0.3);
  const Eigen::Vector3d left = s.tip(0);
  s.go(1.0);
  EXPECT_LT((s.tip(0) - left).norm(), 1e-6) << "the paused trajectory must not lead back";
  // And a new trajectory starts from here.
  ASSERT_EQ(s.start(spec).accepted, 1);
  Eigen::Vector3d last = s.tip(0);
  for (int i = 0; i < 500; ++i) {
    s.step();
    EXPECT_LT((s.tip(0) - last).norm(), 0.05e-3);
    last = s.tip(0);
  }
  EXPECT_EQ(s.source(), dds::Source::kPlanning);
  EXPECT_EQ(s.output.status.faults[0], 0u);
}

TEST(Operator, AForbiddenRegionIsNeverEnteredAndIsNamed) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> speed(-0.03, 0.03);
  Operated s("laptop", [](config::Deployment& d) {
    d.control_period = 0.01;
    d.teleoperation.options.scale = 1.0;
    d.teleoperation.options.guard.forbidden = {{"vessel", planning::teleoperation::Sphere{{0, 0, 0}, 4e-3}}};
  });
  s.enable();
  auto& region = s.setup.deployment.teleoperation.options.guard.forbidden[0];
  const Eigen::Vector3d center = s.tip(0) + Eigen::Vector3d(0.0, 0.008, 0.0);  // beside the tips
  std::get<planning::teleoperation::Sphere>(region.shape).center = center;
  s.input.operator_present = 1;
  double nearest = 1.0;
  bool named = false;
  for (int i = 0; i < 6000; ++i) {
    if (i % 400 == 0) {
      const Eigen::Vector3d toward = 0.03 * (center - s.tip(0)).normalized();
      s.input.linear = {toward.x() + 0.3 * speed(random), toward.y() + 0.3 * speed(random),
                        toward.z() + 0.3 * speed(random)};
    }
    s.step();
    nearest = std::min({nearest, distance(region, s.tip(0)), distance(region, s.tip(1))});
    named = named || s.snapshot.stages[static_cast<std::size_t>(planning::teleoperation::Stage::kFixture)].limiter ==
                         planning::teleoperation::Limiter::kForbiddenRegion;
  }
  EXPECT_GT(nearest, 0.0);
  EXPECT_LT(nearest, 2e-3) << "it has been tried";
  EXPECT_TRUE(named);
}

TEST(Operator, LimitsHoldTargetsBackAndAreNamed) {
  Operated s;
  s.drive({0.0, 0.0, 0.02});  // outwards, to the end of the tubes
  double before = 0.0;
  for (int i = 0; i < 100 && std::abs(s.tip(0).z() - before) > 1e-5; ++i) {
    before = s.tip(0).z();
    s.go(0.5);
  }
  EXPECT_NE(s.output.status.limited, 0);
  EXPECT_GT(s.output.status.limit_count, 0);
  const Eigen::Vector3d target = Eigen::Vector3d::Map(s.snapshot.target.data());
  EXPECT_LE((target - s.tip(0)).norm(), 2e-3) << "the target does not run away";
  EXPECT_EQ(s.guardActions(), 0u);
  // The reversal takes effect at once.
  const double z = s.tip(0).z();
  s.input.linear = {0.0, 0.0, -0.02};
  s.go(1.0);
  EXPECT_LT(s.tip(0).z(), z - 2e-3);
}

TEST(Operator, BadInputsAreNamedAndNeverObeyed) {
  Operated s;
  s.drive({0.0, 0.0, 0.0});
  const auto refused = [&](auto change) {
    dds::TeleopInput bad = s.input;
    bad.answers_control = s.output.status.sequence;
    bad.sequence = s.input.sequence + 1;
    bad.linear = {0.0, 1.0, 0.0};
    change(bad);
    const std::uint64_t before = s.snapshot.accepted;
    s.control.onInput(bad, s.now);
    s.control.fillSnapshots(s.now, s.snapshot, s.crtk_snapshot);
    EXPECT_EQ(s.snapshot.accepted, before);
    return s.snapshot.refusal;
  };
  using Reason = operation::Reason;
  EXPECT_EQ(refused([](auto& m) { m.linear[1] = std::nan(""); }), Reason::kNotFinite);
  EXPECT_EQ(refused([](auto& m) { m.orientation[0] = INFINITY; }), Reason::kNotFinite);
  EXPECT_EQ(refused([](auto& m) { m.control_session = 1; }), Reason::kOtherControl);
  EXPECT_EQ(refused([](auto& m) { m.sequence -= 1; }), Reason::kOutOfSequence);
  EXPECT_EQ(refused([](auto& m) { m.answers_control = 0; }), Reason::kLate);
  EXPECT_EQ(refused([](auto& m) { m.answers_control += 1000; }), Reason::kLate);
  EXPECT_EQ(refused([](auto& m) { m.device = 9; }), Reason::kDevice);
  EXPECT_EQ(refused([](auto& m) { m.kind = 0; }), Reason::kKind);
  EXPECT_EQ(refused([](auto& m) { m.frame = 2; }), Reason::kFrame);
  EXPECT_EQ(refused([](auto& m) {
              m.frame = 1;
              m.view = {1, 1, 0, 0};
            }),
            Reason::kView);
  EXPECT_EQ(refused([](auto& m) { m.mode = 4; }), Reason::kMode);
  EXPECT_EQ(refused([](auto& m) { m.other_arm = 0; }), Reason::kMode);
  EXPECT_EQ(refused([](auto& m) { m.arm = 2; }), Reason::kArm);
  EXPECT_EQ(refused([](auto& m) { m.scale = 2.0; }), Reason::kScale);
  EXPECT_EQ(refused([](auto& m) { m.client = 0; }), Reason::kNotCommander);
}

TEST(Operator, TheOperatorsCycleAllocatesNothing) {
  Operated s;
  s.drive({0.0, 0.01, 0.0});
  dds::TeleopInput input = s.input;
  std::size_t allocated = 0;
  for (int i = 0; i < 300; ++i) {
    s.step();
    if (s.ticks % 10 != 0)
      continue;
    input.answers_control = s.output.status.sequence;
    input.sequence = s.input.sequence + 1;
    const std::size_t before = allocationCount();
    s.control.onInput(input, s.now);
    s.control.cycle(s.now, false, s.output);
    s.control.fillSnapshots(s.now, s.snapshot, s.crtk_snapshot);
    allocated += allocationCount() - before;
  }
  if (canCountAllocations()) {
    EXPECT_EQ(allocated, 0u);
  }
}

}  // namespace
}  // namespace tandem::test
