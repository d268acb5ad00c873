// SPDX-License-Identifier: Apache-2.0
/** @file Recovery and withdrawal by the lease owner, over control and simulated drives. */
#include <gtest/gtest.h>

#include "safety/recovery.h"
#include "tests/unit/services/system.h"

namespace tandem::test {
namespace {

using dds::ControlKind;
using safety::jointBit;
using safety::JointMask;
using safety::OperatingState;
using safety::StateCommand;

/// Request of a client to the first arm.
operation::ParsedControlRequest toFirstArm(const System& s, ControlKind kind, std::uint64_t client = 7) {
  operation::ParsedControlRequest o = s.requestOf(kind, client);
  o.command = StateCommand::kRecover;
  o.arm = 0;
  return o;
}

/** A system with one failed axis of the first arm, and a client that has the lease. */
struct Broken : System {
  explicit Broken(const char* deployment, int joint) : System(deployment) {
    run(0.3);
    sendRequest(ControlKind::kAcquireLease);
    command(StateCommand::kEnable);
    run(0.5);
    dds::SimRequest fault;
    fault.kind = 3;
    fault.joint = static_cast<std::uint8_t>(joint);
    fault.fault = "off";
    EXPECT_EQ(sim.onRequest(fault).accepted, 1);
    EXPECT_GE(until([&] { return shown(0) == OperatingState::kFault; }, 1.0), 0.0);
    keep();
  }
  void keep() { sendRequest(ControlKind::kKeepLease); }
  /// Runs for `seconds`, with the lease.
  void live(double seconds) {
    for (double t = 0.0; t < seconds; t += 0.2) {
      keep();
      run(0.2);
    }
  }
  operation::ControlReply recover(JointMask without = 0) {
    operation::ParsedControlRequest o = toFirstArm(*this, ControlKind::kStateCommand);
    o.joint_count = model.size(0);
    for (int j = 0; j < o.joint_count; ++j)
      o.joints[static_cast<std::size_t>(j)] = (without & jointBit(j)) != 0 ? 1.0 : 0.0;
    return control.onRequest(o, now);
  }
  operation::ControlReply withdraw() { return control.onRequest(toFirstArm(*this, ControlKind::kWithdraw), now); }
  safety::ArmVector joints() const { return dds::jointsOf(state.position, 0, model.size(0)); }
  const safety::ArmLimits& limits() const { return *model.limits()[0]; }
};

class Withdraw : public testing::TestWithParam<std::pair<const char*, int>> {};

TEST_P(Withdraw, RetractsWhatIsLeftSlowlyAndWithinTheLimits) {
  const auto [deployment, joint] = GetParam();
  Broken s(deployment, joint);
  const safety::ArmVector start = s.joints();
  EXPECT_EQ(s.command(StateCommand::kEnable).refusal.code(), dds::ReplyCode::kWrongState);
  EXPECT_EQ(s.withdraw().refusal.code(), dds::ReplyCode::kWrongState) << "not without being recovered";
  ASSERT_EQ(s.recover().refusal.code(), dds::ReplyCode::kOk);
  ASSERT_GE(s.until([&] { return s.state.recovery[0] != 0; }, 2.0), 0.0);
  s.run(0.3);
  ASSERT_EQ(s.shown(0), OperatingState::kEnabled);
  EXPECT_EQ(s.state.lost[0], jointBit(joint));
  EXPECT_EQ(s.output.status.recovery[0], 1);
  EXPECT_EQ(s.sendRequest(ControlKind::kHome).refusal.code(), dds::ReplyCode::kWrongState)
      << "home is no way to recover";
  ASSERT_EQ(s.withdraw().refusal.code(), dds::ReplyCode::kOk);
  double violation = -1.0, fastest = 0.0;
  const int n = s.model.size(0);
  for (int i = 0; i < 4000; ++i) {
    s.live(0.2);
    violation = std::max(violation, safety::largestViolation(s.limits(), s.joints()));
    for (int j = 0; j < n; ++j)
      fastest = std::max(fastest, std::abs(s.state.velocity[dds::jointIndex(0, j)]));
    if (i > 2 && s.output.status.busy[0] == 0)
      break;
  }
  EXPECT_EQ(s.output.status.busy[0], 0);
  ASSERT_EQ(s.shown(0), OperatingState::kEnabled) << safety::describeFaults(s.output.status.faults[0]);
  EXPECT_LE(violation, 1e-6);
  EXPECT_LE(fastest, safety::kRecoveryTranslation * 1.001);
  const safety::ArmVector end = s.joints();
  EXPECT_EQ(safety::nextWithdrawal(s.limits(), end, jointBit(joint), 1e-3).joints, 0);
  EXPECT_NEAR(end[joint], start[joint], 1e-9) << "a dead joint";
  for (int j = n / 2; j < n; ++j)
    EXPECT_NEAR(end[j], start[j], 1e-9) << "a rotation";
  for (int j = 0; j < n / 2; ++j)
    EXPECT_LE(end[j], start[j] + 1e-9);
  EXPECT_EQ(s.command(StateCommand::kDisable).refusal.code(), dds::ReplyCode::kOk);
  s.run(0.5);
  EXPECT_EQ(s.drives(0), OperatingState::kDisabled);
}

std::vector<std::pair<const char*, int>> eachAxisOfEachPreset() {
  std::vector<std::pair<const char*, int>> all;
  for (int j = 0; j < 6; ++j)
    all.emplace_back("laptop", j);
  for (int j = 0; j < 3; ++j)
    all.emplace_back("ablation-pair", j);
  return all;
}

INSTANTIATE_TEST_SUITE_P(EachAxisOfEachPreset,
                         Withdraw,
                         testing::ValuesIn(eachAxisOfEachPreset()),
                         [](const auto& instance) {
                           std::string name = instance.param.first;
                           std::erase(name, '-');
                           return name + std::to_string(instance.param.second + 1);
                         });

TEST(Recover, IsTheHoldersAloneAndJogsSlowlyWithoutWhatIsLeftOut) {
  Broken s("laptop", 0);
  EXPECT_EQ(s.control.onRequest(toFirstArm(s, ControlKind::kStateCommand, 8), s.now).refusal.code(),
            dds::ReplyCode::kNotLeaseOwner);
  ASSERT_EQ(s.recover(jointBit(4)).refusal.code(), dds::ReplyCode::kOk);
  s.live(1.0);
  ASSERT_EQ(s.state.lost[0], jointBit(0) | jointBit(4));
  const safety::ArmVector start = s.joints();
  operation::ParsedControlRequest jog = toFirstArm(s, ControlKind::kJog);
  jog.joint_count = 6;
  jog.joints.fill(-5e-3);
  for (int i = 0; i < 5; ++i) {
    jog.answers_control = s.output.status.sequence;
    ASSERT_EQ(s.control.onRequest(jog, s.now).refusal.code(), dds::ReplyCode::kOk);
    s.live(0.2);
  }
  const safety::ArmVector way = s.joints() - start;
  EXPECT_EQ(way[0], 0.0);
  EXPECT_EQ(way[4], 0.0);
  EXPECT_LT(way[1], -0.5e-3);
  EXPECT_GE(way[1], -1.3 * safety::kRecoveryTranslation);
  // A trajectory does not move an arm in recovery.
  planning::TrajectorySpec spec;
  spec.name = "line";
  spec.shape = planning::Line{{0.0, 0.02, 0.0}};
  s.start(spec);
  s.live(0.6);  // the last jog has ended
  const safety::ArmVector before = s.joints();
  s.live(1.0);
  EXPECT_LT((s.joints() - before).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Recover, EnableAndHomeDoNotExtendRecovery) {
  Broken s("laptop", 1);
  ASSERT_EQ(s.recover().refusal.code(), dds::ReplyCode::kOk);
  s.live(1.0);
  const safety::ArmVector before = s.joints();
  for (const StateCommand command : {StateCommand::kEnable, StateCommand::kHome, StateCommand::kUnhome}) {
    EXPECT_EQ(s.command(command).refusal.code(), dds::ReplyCode::kWrongState) << safety::name(command);
    s.live(0.4);
    EXPECT_EQ(s.output.status.recovery[0], 1);
  }
  EXPECT_EQ((s.joints() - before).cwiseAbs().maxCoeff(), 0.0);
}

TEST(Recover, IsRefusedWhileTheDrivesAreNotDisabledYet) {
  System s;
  s.run(0.3);
  s.sendRequest(ControlKind::kAcquireLease);
  s.command(StateCommand::kEnable);
  s.run(0.5);
  s.command(StateCommand::kDisable);
  const operation::ParsedControlRequest o = toFirstArm(s, ControlKind::kStateCommand);
  EXPECT_EQ(s.control.onRequest(o, s.now).refusal.code(), dds::ReplyCode::kWrongState);
  s.run(0.3);
  EXPECT_EQ(s.control.onRequest(o, s.now).refusal.code(), dds::ReplyCode::kOk);
}

TEST(Recover, PowerThatDoesNotComeIsNotWaitedForForEver) {
  System s;
  s.run(0.3);
  s.sendRequest(ControlKind::kAcquireLease);
  s.control_runs = s.state_link = false;
  s.command(StateCommand::kEnable);
  // Drives that accept every command, and remain DISABLED.
  dds::ActuationState unanswered = s.state;
  const auto asks_for_power = [&] {
    return s.output.command.request[0] == static_cast<std::uint8_t>(safety::DriveRequest::kEnable);
  };
  double waited = 0.0;
  for (; waited < 20.0 && (waited == 0.0 || asks_for_power()); waited += 0.1) {
    s.now += 100'000'000;
    s.sendRequest(ControlKind::kKeepLease);
    s.control.cycle(s.now, false, s.output);
    ++unanswered.sequence;
    unanswered.answers_command = s.output.command.sequence;
    s.control.onState(unanswered);
  }
  EXPECT_GT(waited, 5.0) << "drives take their time";
  EXPECT_LT(waited, 10.0) << "power would come because somebody once asked";
  EXPECT_EQ(s.output.status.faults[0], bit(safety::Fault::kDrive));
}

TEST(Recover, TheStopTopicAndALostLeaseStopAWithdrawal) {
  for (const bool by_topic : {true, false}) {
    Broken s("laptop", 1);
    ASSERT_EQ(s.recover().refusal.code(), dds::ReplyCode::kOk);
    s.live(1.0);
    ASSERT_EQ(s.withdraw().refusal.code(), dds::ReplyCode::kOk);
    s.live(1.0);
    ASSERT_FALSE(s.standing());
    if (by_topic) {
      s.sim.onStop();
      s.control.stop();
    }
    ASSERT_GE(s.until([&] { return s.shown(0) == OperatingState::kFault; }, 2.0), 0.0);
    s.run(0.3);
    EXPECT_TRUE(s.standing());
  }
}

}  // namespace
}  // namespace tandem::test
