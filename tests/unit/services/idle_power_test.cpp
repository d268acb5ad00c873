// SPDX-License-Identifier: Apache-2.0
/** @file Power of arms that nobody commands. */
#include <gtest/gtest.h>

#include "tests/unit/services/system.h"

namespace tandem::test {
namespace {

using dds::ControlKind;
using safety::OperatingState;
using safety::StateCommand;

void shorten(config::Deployment& deployment) { deployment.idle_power_off = 3.0; }

/// Lease, enable, and everybody goes.
void enableAndLeave(System& s) {
  s.run(0.3);
  s.order(ControlKind::kAcquireLease);
  s.command(StateCommand::kEnable);
  s.run(0.3);
  ASSERT_EQ(s.drives(0), OperatingState::kEnabled);
  s.order(ControlKind::kReleaseLease);
}

TEST(IdlePower, GoesFromArmsThatNobodyCommandsWithoutAFault) {
  System s("laptop", shorten);
  enableAndLeave(s);
  s.run(2.0);
  EXPECT_EQ(s.drives(0), OperatingState::kEnabled);
  EXPECT_NEAR(s.output.status.idle[0], 2.0, 0.2);
  EXPECT_NEAR(s.output.status.idle_left[0], 1.0, 0.2);
  const auto there = s.state.position;
  s.run(1.5);
  for (int arm : {0, 1}) {
    EXPECT_EQ(s.drives(arm), OperatingState::kDisabled);
    EXPECT_EQ(s.shown(arm), OperatingState::kDisabled);
  }
  EXPECT_EQ(s.output.status.faults[0], 0u);
  EXPECT_EQ(s.output.status.idle_left[0], -1.0);
  EXPECT_EQ(s.state.position, there);
  service::IdleReport report;
  ASSERT_TRUE(s.control.takeIdle(report));
  EXPECT_TRUE(report.powered_off);
  EXPECT_NEAR(report.idle, 3.0, 0.11);
  // Whoever comes enables it as ever.
  s.order(ControlKind::kAcquireLease);
  EXPECT_EQ(s.command(StateCommand::kEnable).code, dds::ReplyCode::kOk);
  s.run(0.3);
  EXPECT_EQ(s.drives(0), OperatingState::kEnabled);
}

TEST(IdlePower, StaysWithWhoeverHoldsTheLeaseAndWithWhatMoves) {
  System s("laptop", shorten);
  enableAndLeave(s);
  s.order(ControlKind::kAcquireLease);
  for (int i = 0; i < 20; ++i) {
    s.run(0.5);
    s.order(ControlKind::kKeepLease);
    EXPECT_EQ(s.output.status.idle[0], 0.0);
  }
  EXPECT_EQ(s.drives(0), OperatingState::kEnabled);
}

TEST(IdlePower, StaysWhereAnArmDoesNotHoldWithoutAndIsWarnedOf) {
  System s("laptop", shorten);
  enableAndLeave(s);
  // The drives of this robot say that they do not hold.
  service::IdleReport report;
  for (int i = 0; i < 10'000; ++i) {
    s.state_link = false;
    s.tick();
    s.state.holds = {};
    s.control.onState(s.state);
  }
  EXPECT_EQ(s.drives(0), OperatingState::kEnabled);
  EXPECT_EQ(s.output.status.idle_left[0], -1.0);
  int warnings = 0;
  while (s.control.takeIdle(report)) {
    EXPECT_FALSE(report.powered_off);
    warnings += report.arm == 0 ? 1 : 0;
  }
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
