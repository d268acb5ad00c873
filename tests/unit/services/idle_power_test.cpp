// SPDX-License-Identifier: Apache-2.0
/** @file Power of arms without a commanding client. */
#include <gtest/gtest.h>

#include "tests/unit/services/system.h"

namespace tandem::test {
namespace {

using dds::ControlKind;
using safety::OperatingState;
using safety::StateCommand;

void shorten(config::Deployment& deployment) { deployment.idle_power_off = 3.0; }

/// Lease, enable, then no client remains.
void enableAndLeave(System& s) {
  s.run(0.3);
  s.sendRequest(ControlKind::kAcquireLease);
  s.command(StateCommand::kEnable);
  s.run(0.3);
  ASSERT_EQ(s.drives(0), OperatingState::kEnabled);
  s.sendRequest(ControlKind::kReleaseLease);
}

TEST(IdlePower, GoesFromArmsThatNobodyCommandsWithoutAFault) {
  System s("laptop", shorten);
  enableAndLeave(s);
  s.run(2.0);
  EXPECT_EQ(s.drives(0), OperatingState::kEnabled);
  EXPECT_NEAR(s.output.status.idle[0], 2.0, 0.2);
  EXPECT_NEAR(s.output.status.idle_left[0], 1.0, 0.2);
  const auto there = s.state.position;
  using Decision = safety::IdlePower::Decision;
  EXPECT_GE(s.until([&] { return s.output.idle[0] != Decision::kNothing; }, 1.5), 0.0);
  EXPECT_EQ(s.output.idle[0], Decision::kPowerOff);
  EXPECT_NEAR(s.output.status.idle[0], 3.0, 0.11);
  s.run(0.5);
  for (int arm : {0, 1}) {
    EXPECT_EQ(s.drives(arm), OperatingState::kDisabled);
    EXPECT_EQ(s.shown(arm), OperatingState::kDisabled);
  }
  EXPECT_EQ(s.output.status.faults[0], 0u);
  EXPECT_EQ(s.output.status.idle_left[0], -1.0);
  EXPECT_EQ(s.state.position, there);
  // The next client enables it as usual.
  s.sendRequest(ControlKind::kAcquireLease);
  EXPECT_EQ(s.command(StateCommand::kEnable).refusal.code(), dds::ReplyCode::kOk);
  s.run(0.3);
  EXPECT_EQ(s.drives(0), OperatingState::kEnabled);
}

TEST(IdlePower, StaysWithWhoeverHoldsTheLeaseAndWithWhatMoves) {
  System s("laptop", shorten);
  enableAndLeave(s);
  s.sendRequest(ControlKind::kAcquireLease);
  for (int i = 0; i < 20; ++i) {
    s.run(0.5);
    s.sendRequest(ControlKind::kKeepLease);
    EXPECT_EQ(s.output.status.idle[0], 0.0);
  }
  EXPECT_EQ(s.drives(0), OperatingState::kEnabled);
}

TEST(IdlePower, StaysWhereAnArmDoesNotHoldWithoutAndIsWarnedOf) {
  System s("laptop", shorten);
  enableAndLeave(s);
  // The drives of this robot report that they do not hold without power.
  int warnings = 0;
  for (int i = 0; i < 10'000; ++i) {
    s.state_link = false;
    s.tick();
    if (s.ticks % s.control_every == 0) {
      EXPECT_NE(s.output.idle[0], safety::IdlePower::Decision::kPowerOff);
      warnings += s.output.idle[0] == safety::IdlePower::Decision::kWarn ? 1 : 0;
    }
    s.state.holds = {};
    s.control.onState(s.state);
  }
  EXPECT_EQ(s.drives(0), OperatingState::kEnabled);
  EXPECT_EQ(s.output.status.idle_left[0], -1.0);
  EXPECT_EQ(warnings, 3);
}

TEST(IdlePower, PausedArmsWithoutACommanderLoseItToo) {
  System s("laptop", shorten);
  enableAndLeave(s);
  s.command(StateCommand::kPause);
  s.run(3.5);
  EXPECT_EQ(s.drives(0), OperatingState::kDisabled);
}

}  // namespace
}  // namespace tandem::test
