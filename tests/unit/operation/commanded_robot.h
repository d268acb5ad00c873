// SPDX-License-Identifier: Apache-2.0
/** @file Test fixture: control with ideal drives and client requests. */
#pragma once

#include <gtest/gtest.h>

#include "operation/control_core.h"
#include "tests/unit/operation/rig.h"

namespace tandem::test {

using namespace operation;
using msg::ControlKind;
using safety::Fault;
using safety::OperatingState;
using safety::StateCommand;

constexpr std::uint64_t kFirst = 7, kSecondClient = 8;

/** Control with ideal drives, and clients that have received its last status. */
struct CommandedRobot {
  Rig rig;
  Drives drives{rig};
  ControlCore core{rig.setup(), rig.tracker()};
  CycleOutput output;
  std::int64_t now = kSecond;

  CommandedRobot() { cycle(); }
  void cycle() {
    now += rig.period();
    drives.take(output.command);
    core.onState(drives.state);
    core.cycle(now, false, output);
  }
  void run(double seconds, std::uint64_t keeper = 0) {
    for (int i = 0; i < seconds / rig.deployment.control_period; ++i) {
      if (keeper != 0)
        give(requestOf(keeper, ControlKind::kKeepLease));
      cycle();
    }
  }
  ParsedControlRequest requestOf(std::uint64_t client, ControlKind kind) const {
    ParsedControlRequest o;
    o.client = client;
    o.kind = kind;
    o.control_session = output.status.session;
    o.answers_control = output.status.sequence;
    return o;
  }
  ParsedControlRequest stateRequest(std::uint64_t client, StateCommand command) const {
    ParsedControlRequest o = requestOf(client, ControlKind::kStateCommand);
    o.command = command;
    return o;
  }
  /// A slow jog of a rotation.
  ParsedControlRequest jogRequest(std::uint64_t client, int arm) const {
    ParsedControlRequest o = requestOf(client, ControlKind::kJog);
    o.arm = arm;
    o.joint_count = 6;
    o.joints[4] = 0.1;
    return o;
  }
  /// A long motion, of some seconds.
  ParsedControlRequest moveRequest(std::uint64_t client, int arm, double turn = 1.0) const {
    ParsedControlRequest o = requestOf(client, ControlKind::kMoveJp);
    o.arm = arm;
    o.joint_count = 6;
    Eigen::VectorXd::Map(o.joints.data(), 6) = rig.robot.arms[static_cast<std::size_t>(arm)].home;
    o.joints[4] += turn;
    return o;
  }
  Reason give(const ParsedControlRequest& request) { return core.onRequest(request, now).refusal.reason; }
  void enable(std::uint64_t client) {
    ASSERT_EQ(give(requestOf(client, ControlKind::kAcquireLease)), Reason::kNone);
    ASSERT_EQ(give(stateRequest(client, StateCommand::kEnable)), Reason::kNone);
    run(0.1, client);
    ASSERT_EQ(state(0), OperatingState::kEnabled);
  }
  OperatingState state(int arm) const { return static_cast<OperatingState>(output.status.operating_state[at(arm)]); }
  bool moves(int arm) const {
    for (int j = 0; j < 6; ++j) {
      if (output.command.velocity[msg::jointIndex(arm, j)] != 0.0)
        return true;
    }
    return false;
  }
  std::int64_t lease() const { return static_cast<std::int64_t>(1e9 * rig.deployment.budgets.lease); }
  static std::size_t at(int arm) { return static_cast<std::size_t>(arm); }
};

}  // namespace tandem::test
