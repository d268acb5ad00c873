// SPDX-License-Identifier: Apache-2.0
/** @file CRTK commands with control and the simulated robot. */
#include <gtest/gtest.h>

#include <random>

#include "operation/convert.h"
#include "tests/unit/services/system.h"

namespace tandem::test {
namespace {

using dds::ControlKind;
using operation::CrtkOutcome;
using operation::CrtkRequest;
using operation::CrtkSnapshot;
using operation::kPairGroup;
using safety::OperatingState;
using safety::StateCommand;

int verbOf(std::string_view name) {
  for (std::size_t i = 0; i < operation::kCrtkVerbs.size(); ++i) {
    if (operation::kCrtkVerbs[i].name == name)
      return static_cast<int>(i);
  }
  ADD_FAILURE() << name;
  return 0;
}

CrtkRequest requestFor(std::string_view name, int group, const Eigen::VectorXd& values) {
  CrtkRequest request;
  request.verb = verbOf(name);
  request.group = group;
  request.count = static_cast<int>(values.size());
  std::copy(values.begin(), values.end(), request.values.begin());
  return request;
}

struct Crtk : System {
  Crtk(
      const std::string& deployment = "laptop",
      Change change = [](config::Deployment& d) { d.control_period = 0.01; })
      : System(deployment, change) {}

  operation::ControlReply topic(StateCommand command, int arm = dds::kAllArms) {
    operation::ParsedControlRequest o;
    o.kind = ControlKind::kStateCommand;
    o.command = command;
    o.arm = arm;
    o.from_topic = true;
    o.control_session = output.status.session;
    o.answers_control = output.status.sequence;
    return control.onRequest(o, now);
  }
  void enable() {
    run(0.3);
    topic(StateCommand::kEnable);
    run(0.3);
  }
  CrtkOutcome send(std::string_view name, int group, const Eigen::VectorXd& values) {
    return control.crtk(requestFor(name, group, values), now);
  }
  /// Runs, and repeats `values` as a stream of 100 Hz.
  template <class Values>
  void stream(std::string_view name, int group, double seconds, Values values) {
    for (int i = 0; i < static_cast<int>(100 * seconds); ++i) {
      const CrtkOutcome outcome = send(name, group, values());
      ASSERT_TRUE(outcome.accepted) << name << ": " << outcome.reason.data();
      run(0.01);
      check();
    }
  }
  /// Invariants.
  void check() {
    for (int k = 0; k < 2; ++k)
      ASSERT_LE(safety::largestViolation(*model.limits()[static_cast<std::size_t>(k)], joints(k)), 1e-9);
    control.fillSnapshots(now, snapshot, crtk);
  }
  safety::ArmVector joints(int k) { return dds::jointsOf(state.position, k, model.size(k)); }
  Eigen::VectorXd both() {
    Eigen::VectorXd q(12);
    q << joints(0), joints(1);
    return q;
  }
  Eigen::Vector3d tip(int k) {
    kinematics::Tip found;
    EXPECT_EQ(model.models()[static_cast<std::size_t>(k)]->tip(joints(k), found), kinematics::ModelStatus::kOk);
    return found.pose.translation();
  }
  bool busy(int k) const { return output.status.busy[static_cast<std::size_t>(k)] != 0; }
  std::string ended() {
    const std::string reason = endings.empty() ? "" : endings.front().reason.data();
    endings.clear();
    return reason;
  }

  operation::OperatorSnapshot snapshot;
  CrtkSnapshot crtk;
};

Eigen::VectorXd joint(int j, double value) {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(6);
  q[j] = value;
  return q;
}

TEST(CrtkMotion, ServoMovesAsItComesAndStopsWhenItFallsSilent) {
  Crtk s;
  s.enable();
  Eigen::Vector3d target = s.tip(0);
  const Eigen::Vector3d start = target, other = s.tip(1);
  s.stream("servo_cp", 0, 1.0, [&] {
    target.y() += 5e-5;
    return target;
  });
  EXPECT_EQ(s.output.status.source, static_cast<std::uint8_t>(dds::Source::kCrtk));
  EXPECT_EQ(s.output.status.lease_owner, dds::kCrtkClient);
  EXPECT_FALSE(s.busy(0)) << "servo is not busy";
  EXPECT_NEAR(s.tip(0).y() - start.y(), 5e-3, 0.4e-3);
  EXPECT_LT((s.tip(1) - other).norm(), 1e-6);
  const double seconds = s.until([&] { return s.standing(); }, 1.0);
  EXPECT_GE(seconds, 0.0);
  EXPECT_LE(seconds, 0.1 + 2 * 0.01 + 5e-3 / 0.1);
  EXPECT_NE(s.ended().find("no sample of the stream"), std::string::npos);
  s.run(0.05);
  EXPECT_EQ(s.output.status.lease_owner, 0u) << "others may command again";
}

TEST(CrtkMotion, EveryCommandReachesItsGoal) {
  Crtk s;
  s.enable();
  Eigen::VectorXd q = s.joints(0);
  s.stream("servo_jp", 0, 0.5, [&] {
    q[3] += 1e-3;
    return q;
  });
  s.run(0.2);
  EXPECT_NEAR(s.joints(0)[3], q[3], 1e-6);
  double from = s.joints(0)[4];
  s.stream("servo_jr", 0, 0.5, [&] { return joint(4, 1e-3); });
  s.run(0.3);
  EXPECT_NEAR(s.joints(0)[4] - from, 0.05, 1e-3);
  from = s.joints(0)[5];
  s.stream("servo_jv", 0, 0.5, [&] { return joint(5, 0.1); });
  s.run(0.3);
  EXPECT_NEAR(s.joints(0)[5] - from, 0.05 + 0.1 * 0.11, 6e-3);  // until the stream is detected as silent

  Eigen::Vector3d at = s.tip(0);
  s.stream("servo_cr", 0, 0.5, [&] { return Eigen::Vector3d(0.0, 2e-5, 0.0); });
  EXPECT_NEAR(s.tip(0).y() - at.y(), 1e-3, 0.3e-3);
  s.run(0.3);
  at = s.tip(0);
  s.stream("servo_cv", 0, 0.5, [&] { return Eigen::Vector3d(0.0, -2e-3, 0.0); });
  EXPECT_NEAR(s.tip(0).y() - at.y(), -1e-3, 0.3e-3);
  s.run(0.3);

  q = s.joints(0);
  q[3] -= 0.2;
  s.stream("interpolate_jp", 0, 2.0, [&] { return q; });
  EXPECT_NEAR(s.joints(0)[3], q[3], 1e-6);
  from = s.joints(0)[3];
  s.run(0.5);
  s.stream("interpolate_jr", 0, 0.01, [&] { return joint(3, 0.02); });
  s.run(0.5);
  EXPECT_NEAR(s.joints(0)[3] - from, 0.02, 0.019) << "it goes on for as long as a reference may be old";
  s.stream("interpolate_jv", 0, 1.0, [&] { return joint(3, 0.05); });
  s.run(0.5);

  at = s.tip(0);
  const Eigen::Vector3d goal = at + Eigen::Vector3d(0.0, 4e-3, 0.0);
  s.stream("interpolate_cp", 0, 2.0, [&] { return goal; });
  EXPECT_LT((s.tip(0) - goal).norm(), 0.1e-3);
  EXPECT_EQ(s.crtk.has_cp[0], 1);
  s.run(0.5);
  s.stream("interpolate_cv", 0, 0.5, [&] { return Eigen::Vector3d(0.0, -2e-3, 0.0); });
  EXPECT_EQ(s.crtk.has_cv[0], 1);
  s.run(0.5);
  at = s.tip(0);
  s.stream("interpolate_cr", 0, 0.01, [&] { return Eigen::Vector3d(0.0, 5e-4, 0.0); });
  s.run(0.24);
  EXPECT_GT(s.tip(0).y() - at.y(), 1e-4);
  s.run(0.5);

  for (const auto& [name, value] : {std::pair<std::string, Eigen::VectorXd>{"move_cr", Eigen::Vector3d(0, 3e-3, 0)},
                                    {"move_cp", s.tip(0) - Eigen::Vector3d(0, 2e-3, 0)}}) {
    at = s.tip(0);
    const Eigen::Vector3d to = name == "move_cr" ? Eigen::Vector3d(at + value) : Eigen::Vector3d(value);
    ASSERT_TRUE(s.send(name, 0, value).accepted);
    s.run(0.1);
    EXPECT_TRUE(s.busy(0)) << name;
    EXPECT_GE(s.until([&] { return !s.busy(0); }, 5.0), 0.0) << name;
    EXPECT_LT((s.tip(0) - to).norm(), 0.1e-3) << name;
  }
  q = s.joints(0);
  q[4] += 0.3;
  for (const char* name : {"move_jp", "move_jr"}) {
    const Eigen::VectorXd to = std::string(name) == "move_jp" ? q : Eigen::VectorXd(s.joints(0) + joint(4, -0.2));
    ASSERT_TRUE(s.send(name, 0, std::string(name) == "move_jp" ? q : joint(4, -0.2)).accepted);
    s.run(0.1);
    EXPECT_TRUE(s.busy(0)) << name;
    EXPECT_GE(s.until([&] { return !s.busy(0); }, 5.0), 0.0) << name;
    EXPECT_LT((s.joints(0) - to).norm(), 1e-5) << name;
  }
  EXPECT_EQ(s.guardActions(), 0u);
  EXPECT_EQ(s.output.status.faults[0], 0u);
}

TEST(CrtkMotion, ThePairIsTheRelativePositionAndTheJointsOfBoth) {
  Crtk s;
  s.enable();
  const Eigen::Vector3d a = s.tip(0), x = s.tip(0) - s.tip(1);
  s.stream("interpolate_cp", kPairGroup, 2.0, [&] { return Eigen::Vector3d(x + Eigen::Vector3d(0.0, 3e-3, 0.0)); });
  EXPECT_NEAR((s.tip(0) - s.tip(1) - x).y(), 3e-3, 0.1e-3);
  EXPECT_LT((s.tip(0) - a).norm(), 0.1e-3) << "the first arm's tip stays";
  // The cooperative scheme: the first tip is commanded, the relative position is constant.
  const Eigen::Vector3d kept = s.tip(0) - s.tip(1);
  Eigen::Vector3d target = s.tip(0);
  double worst = 0.0;
  for (int i = 0; i < 200; ++i) {
    target.y() += 3e-5;
    ASSERT_TRUE(s.send("servo_cp", kPairGroup, kept).accepted);
    ASSERT_TRUE(s.send("servo_cp", 0, target).accepted);
    s.run(0.01);
    s.check();
    worst = std::max(worst, (s.tip(0) - s.tip(1) - kept).norm());
  }
  EXPECT_LT(worst, 0.2e-3);
  EXPECT_GT(s.tip(0).y() - a.y(), 5e-3);
  s.run(0.5);
  Eigen::VectorXd q = s.both();
  q[3] += 0.1;
  q[9] -= 0.1;
  ASSERT_TRUE(s.send("move_jp", kPairGroup, q).accepted);
  EXPECT_GE(s.until([&] { return s.busy(0) && s.busy(1); }, 0.5), 0.0);
  EXPECT_GE(s.until([&] { return !s.busy(0) && !s.busy(1); }, 5.0), 0.0);
  EXPECT_LT((s.both() - q).norm(), 1e-5);
}

TEST(CrtkMotion, WhatIsNotValidIsNamedAndMovesNothing) {
  Crtk s;
  s.run(0.3);
  const auto reason = [&](std::string_view name, int group, const Eigen::VectorXd& values) {
    const CrtkOutcome outcome = s.send(name, group, values);
    EXPECT_FALSE(outcome.accepted) << name;
    return std::string(outcome.reason.data());
  };
  const auto has = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  EXPECT_TRUE(has(reason("servo_cp", 0, s.tip(0)), "not ENABLED"));
  EXPECT_TRUE(has(reason("move_jp", kPairGroup, s.both()), "not ENABLED"));
  s.enable();
  const auto there = s.state.position;
  EXPECT_TRUE(has(reason("servo_cp", 0, s.tip(0) + Eigen::Vector3d(0.01, 0, 0)), "step"));
  EXPECT_TRUE(has(reason("servo_cr", 1, Eigen::Vector3d(0, 0.01, 0)), "step"));
  EXPECT_TRUE(has(reason("servo_jp", 0, s.joints(0) + joint(3, 0.2)), "joint 4: found a step"));
  EXPECT_TRUE(has(reason("servo_jr", 0, joint(0, 5e-3)), "joint 1: found a step"));
  EXPECT_TRUE(has(reason("move_jp", 0, joint(0, 0.5)), "outside"));
  EXPECT_TRUE(has(reason("interpolate_jp", 0, joint(0, 0.5)), "outside"));
  s.topic(StateCommand::kUnhome, 0);
  EXPECT_TRUE(has(reason("servo_cp", 0, s.tip(0)), "not homed"));
  s.sendRequest(ControlKind::kAcquireLease, 9);
  EXPECT_TRUE(has(reason("servo_cp", 1, s.tip(1)), "lease"));
  s.run(0.3);
  EXPECT_EQ(s.state.position, there);
}

TEST(CrtkMotion, AStreamKeepsOthersFromCommandingUntilItEnds) {
  Crtk s;
  s.enable();
  s.stream("servo_cp", 0, 0.2, [&] { return s.tip(0); });
  EXPECT_EQ(s.sendRequest(ControlKind::kAcquireLease, 9).refusal.code(), dds::ReplyCode::kLeaseTaken);
  EXPECT_EQ(s.topic(StateCommand::kPause).refusal.code(), dds::ReplyCode::kOk)
      << "state_command is of the same clients";
  s.run(0.2);
  EXPECT_EQ(s.sendRequest(ControlKind::kAcquireLease, 9).refusal.code(), dds::ReplyCode::kOk);
}

TEST(CrtkMotion, HoldAndDisableEndMotions) {
  Crtk s;
  s.enable();
  for (const bool hold : {true, false}) {
    ASSERT_TRUE(s.send("move_cr", 0, Eigen::Vector3d(0, 5e-3, 0)).accepted);
    s.run(0.3);
    ASSERT_FALSE(s.standing());
    if (hold)
      ASSERT_TRUE(s.send("hold", 0, Eigen::VectorXd()).accepted);
    else
      s.topic(StateCommand::kDisable);
    const double seconds = s.until([&] { return s.standing(); }, 1.0);
    EXPECT_GE(seconds, 0.0);
    EXPECT_LE(seconds, 0.1);
    s.run(0.1);
    EXPECT_FALSE(s.busy(0));
  }
}

/// The table of CRTK's states, arm by arm, through state_command.
TEST(CrtkMotion, TheStateTableHoldsAndOnlyEnabledArmsMove) {
  using enum idl::OperatingState;
  struct Row {
    StateCommand command;
    OperatingState from, to;
    bool accepted;
  };
  const std::vector<Row> table{
      {StateCommand::kPause, kDisabled, kDisabled, false}, {StateCommand::kResume, kDisabled, kDisabled, false},
      {StateCommand::kEnable, kDisabled, kEnabled, true},  {StateCommand::kEnable, kEnabled, kEnabled, true},
      {StateCommand::kResume, kEnabled, kEnabled, false},  {StateCommand::kPause, kEnabled, kPaused, true},
      {StateCommand::kPause, kPaused, kPaused, true},      {StateCommand::kEnable, kPaused, kPaused, false},
      {StateCommand::kResume, kPaused, kEnabled, true},    {StateCommand::kPause, kEnabled, kPaused, true},
      {StateCommand::kDisable, kPaused, kDisabled, true},  {StateCommand::kDisable, kDisabled, kDisabled, true}};
  Crtk s;
  s.run(0.3);
  for (std::size_t i = 0; i < table.size(); ++i) {
    const Row& row = table[i];
    ASSERT_EQ(s.shown(0), row.from) << i;
    EXPECT_EQ(s.topic(row.command).refusal.code() == dds::ReplyCode::kOk, row.accepted) << i;
    s.run(0.4);
    EXPECT_EQ(s.shown(0), row.to) << i;
    EXPECT_EQ(s.send("servo_cp", 0, s.tip(0)).accepted, row.to == kEnabled) << i;
    s.run(0.3);
  }
}

TEST(CrtkMotion, RandomClientsNeverBreakLimitsAndNeverFault) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  Crtk s;
  s.enable();
  int accepted = 0;
  for (int i = 0; i < 1500; ++i) {
    const int verb = static_cast<int>(random() % (operation::kCrtkVerbs.size() - 1));
    const auto& kind = operation::kCrtkVerbs[static_cast<std::size_t>(verb)];
    const int group = std::array{0, 1, kPairGroup}[random() % 3];
    const bool cartesian = kind.space == operation::CrtkSpace::kCartesian;
    const int n = cartesian ? 3 : group == kPairGroup ? 12 : 6;
    Eigen::VectorXd values(n);
    for (double& v : values)
      v = (cartesian ? 5e-3 : 0.02) * number(random);
    if (kind.kind == operation::CrtkKind::kPosition && cartesian)
      values += group == kPairGroup ? Eigen::Vector3d(s.tip(0) - s.tip(1)) : s.tip(group);
    if (kind.kind == operation::CrtkKind::kPosition && !cartesian)
      values += group == kPairGroup ? s.both() : Eigen::VectorXd(s.joints(group));
    const CrtkOutcome outcome = s.send(kind.name, group, values);
    accepted += outcome.accepted ? 1 : 0;
    EXPECT_TRUE(outcome.accepted || outcome.reason[0] != '\0');
    s.run(0.01 * static_cast<double>(1 + random() % 4));
    s.check();
    ASSERT_EQ(s.output.status.faults[0] | s.output.status.faults[1], 0u) << kind.name;
  }
  EXPECT_GT(accepted, 300);
}

TEST(CrtkMotion, InLockStepOnlyJointMotionsAreObeyed) {
  Crtk s("lockstep", nullptr);
  CrtkOutcome outcome = s.send("servo_cp", 0, Eigen::Vector3d::Zero());
  EXPECT_NE(std::string(outcome.reason.data()).find("lock-step"), std::string::npos);
  outcome = s.send("move_jp", 0, Eigen::VectorXd::Zero(6));
  EXPECT_NE(std::string(outcome.reason.data()).find("not ENABLED"), std::string::npos);
}

}  // namespace
}  // namespace tandem::test
