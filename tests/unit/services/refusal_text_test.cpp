// SPDX-License-Identifier: Apache-2.0
// Texts of control's refusals: joint and amount, state and the way out.
#include <gtest/gtest.h>

#include "tests/unit/services/system.h"

namespace tandem::test {
namespace {

using dds::ControlKind;
using safety::StateCommand;

TEST(RefusalText, EnablingOutsideTheLimitsIsRefusedWithByHowMuch) {
  System s;
  s.run(0.2);
  s.sendRequest(ControlKind::kAcquireLease);
  s.state_link = false;
  dds::ActuationState outside = s.state;
  outside.position[dds::jointIndex(0, 2)] = s.model.limits()[0]->joints[2].upper + 1.23e-3;
  ++outside.sequence;
  s.control.onState(outside);
  const operation::ControlReply answer = s.command(StateCommand::kEnable);
  EXPECT_EQ(answer.refusal.code(), dds::ReplyCode::kOutsideLimits);
  const std::string reason = describe(answer.refusal, s.setup.robot);
  EXPECT_NE(reason.find("beta_3 is 1.23 mm outside"), std::string::npos) << reason;
  EXPECT_NE(reason.find("recover"), std::string::npos) << reason;
}

TEST(RefusalText, AMoveOfAnArmThatIsNotEnabledIsRefusedWithItsStateAndTheWayOut) {
  System s;
  s.run(0.3);
  s.sendRequest(ControlKind::kAcquireLease);
  s.command(StateCommand::kEnable);
  s.run(0.3);
  const auto refusal = [&] {
    s.sendRequest(ControlKind::kKeepLease);
    return describe(s.sendRequest(ControlKind::kHome).refusal, s.setup.robot);
  };
  s.command(StateCommand::kPause);
  s.run(0.3);
  EXPECT_EQ(refusal(), "arm_a: the arm is PAUSED, not ENABLED; 'resume' continues, 'disable' ends the motion");
  s.sendRequest(ControlKind::kKeepLease);
  s.command(StateCommand::kDisable);
  s.run(0.3);
  EXPECT_EQ(refusal(), "arm_a: the arm is not ENABLED; enable it first");
  s.command(StateCommand::kEnable);
  s.run(0.3);
  s.state_link = false;
  s.run(0.4);  // less than the lease
  EXPECT_EQ(refusal(), "arm_a: the arm is in FAULT, not ENABLED; 'disable' clears the fault, then 'enable'");
}

}  // namespace
}  // namespace tandem::test
