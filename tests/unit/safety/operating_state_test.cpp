// SPDX-License-Identifier: Apache-2.0
#include "safety/operating_state.h"

#include <gtest/gtest.h>

#include <map>

namespace tandem::safety {
namespace {

using State = OperatingState;
using Do = StateCommand;

TEST(Transition, IsTheTableOfCrtkButForFault) {
  const std::map<std::pair<State, Do>, State> allowed{
      {{State::kDisabled, Do::kEnable}, State::kEnabled},  {{State::kDisabled, Do::kDisable}, State::kDisabled},
      {{State::kDisabled, Do::kUnhome}, State::kDisabled}, {{State::kEnabled, Do::kEnable}, State::kEnabled},
      {{State::kEnabled, Do::kDisable}, State::kDisabled}, {{State::kEnabled, Do::kPause}, State::kPaused},
      {{State::kEnabled, Do::kHome}, State::kEnabled},     {{State::kEnabled, Do::kUnhome}, State::kEnabled},
      {{State::kPaused, Do::kDisable}, State::kDisabled},  {{State::kPaused, Do::kPause}, State::kPaused},
      {{State::kPaused, Do::kResume}, State::kEnabled},    {{State::kPaused, Do::kUnhome}, State::kPaused},
      {{State::kFault, Do::kDisable}, State::kDisabled},
  };
  for (const State state : {State::kDisabled, State::kEnabled, State::kPaused, State::kFault}) {
    for (const Do command : {Do::kEnable, Do::kDisable, Do::kPause, Do::kResume, Do::kHome, Do::kUnhome}) {
      const auto found = allowed.find({state, command});
      const auto expected = found == allowed.end() ? std::nullopt : std::optional(found->second);
      EXPECT_EQ(transition(state, command), expected) << name(state) << " " << name(command);
    }
  }
}

TEST(StateMachine, FaultLeavesOnlyByDisableWhenItsCauseIsGone) {
  StateMachine machine;
  ASSERT_TRUE(machine.command(Do::kEnable));
  EXPECT_TRUE(machine.mayMove());
  machine.latch(bit(Fault::kDrive) | bit(Fault::kCommandTimeout));
  EXPECT_EQ(machine.state(), State::kFault);
  for (const Do command : {Do::kEnable, Do::kPause, Do::kResume, Do::kHome, Do::kUnhome}) {
    EXPECT_FALSE(machine.command(command));
    EXPECT_EQ(machine.state(), State::kFault);
  }
  EXPECT_FALSE(machine.command(Do::kDisable, bit(Fault::kDrive)));
  EXPECT_EQ(machine.state(), State::kFault);
  EXPECT_EQ(machine.faults(), bit(Fault::kDrive));
  EXPECT_TRUE(machine.command(Do::kDisable));
  EXPECT_EQ(machine.state(), State::kDisabled);
  EXPECT_EQ(machine.faults(), 0u);
}

TEST(StateMachine, GivesNoPowerWhileACauseStands) {
  StateMachine machine;
  EXPECT_FALSE(machine.command(Do::kEnable, bit(Fault::kSensor)));
  EXPECT_EQ(machine.state(), State::kDisabled);
  ASSERT_TRUE(machine.command(Do::kEnable));
  ASSERT_TRUE(machine.command(Do::kPause, bit(Fault::kSensor)));
  EXPECT_FALSE(machine.command(Do::kResume, bit(Fault::kSensor)));
  EXPECT_EQ(machine.state(), State::kPaused);
}

TEST(Names, RoundTripAndCoverEveryValue) {
  for (const Do command : {Do::kEnable, Do::kDisable, Do::kPause, Do::kResume, Do::kHome, Do::kUnhome}) {
    EXPECT_EQ(idl::fromName<safety::StateCommand>(name(command)), command);
  }
  EXPECT_EQ(idl::fromName<safety::StateCommand>("ENABLE"), std::nullopt);
  EXPECT_EQ(name(State::kFault), "FAULT");
  EXPECT_EQ(describeFaults(0), "none");
  EXPECT_EQ(describeFaults(bit(Fault::kDrive) | bit(Fault::kCommandTimeout)), "command_timeout, drive");
  EXPECT_EQ(describeFaults(bit(Fault::kSolver) | 1u << 31), "solver, unknown");
  for (int g = 0; g < kGuardCount; ++g)
    EXPECT_NE(name(static_cast<Guard>(g)), "unknown");
  EXPECT_EQ(name(static_cast<Guard>(kGuardCount)), "unknown");
}

}  // namespace
}  // namespace tandem::safety
