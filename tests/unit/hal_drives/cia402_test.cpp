// SPDX-License-Identifier: Apache-2.0
#include "hal/drives/cia402.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/unit/safety/random_arm.h"

namespace tandem::hal {
namespace {

using test::Random;

/// A drive according to the profile: at most one transition per cycle, on the controlword of the previous cycle.
class ProfileDrive {
 public:
  DriveState state = DriveState::kSwitchOnDisabled;

  std::uint16_t statusword() const {
    switch (state) {
      case DriveState::kNotReady:
        return 0x0000;
      case DriveState::kSwitchOnDisabled:
        return 0x0040;
      case DriveState::kReadyToSwitchOn:
        return 0x0021;
      case DriveState::kSwitchedOn:
        return 0x0023;
      case DriveState::kOperationEnabled:
        return 0x0027;
      case DriveState::kQuickStopActive:
        return 0x0007;
      case DriveState::kFaultReaction:
        return 0x000F;
      case DriveState::kFault:
        return 0x0008;
      case DriveState::kUnknown:
        break;
    }
    return 0x00FF;
  }

  void take(std::uint16_t word) {
    const bool edge = (word & 0x80) != 0 && (last_ & 0x80) == 0;
    last_ = word;
    if (state == DriveState::kFault) {
      if (edge)
        state = DriveState::kSwitchOnDisabled;
      return;
    }
    if (state == DriveState::kNotReady || state == DriveState::kFaultReaction)
      return;
    if ((word & 0x02) == 0) {  // disable voltage
      state = DriveState::kSwitchOnDisabled;
      return;
    }
    if ((word & 0x06) == 0x02) {  // quick stop
      state = state == DriveState::kOperationEnabled || state == DriveState::kQuickStopActive
                  ? DriveState::kQuickStopActive
                  : DriveState::kSwitchOnDisabled;
      return;
    }
    const int command = word & 0x0F;
    if (state == DriveState::kQuickStopActive)
      return;
    if (command == 0x06) {
      state = DriveState::kReadyToSwitchOn;
    } else if (command == 0x07) {
      if (state != DriveState::kSwitchOnDisabled)
        state = DriveState::kSwitchedOn;
    } else if (command == 0x0F && (state == DriveState::kSwitchedOn || state == DriveState::kOperationEnabled)) {
      state = DriveState::kOperationEnabled;
    }
  }

 private:
  std::uint16_t last_ = 0;
};

TEST(Cia402, EveryStatuswordHasOneState) {
  // According to the table of the profile: bits outside the masks never change the state.
  std::set<DriveState> seen;
  for (int word = 0; word < 0x10000; ++word) {
    const auto value = static_cast<std::uint16_t>(word);
    const DriveState state = driveState(value);
    seen.insert(state);
    EXPECT_EQ(state, driveState(static_cast<std::uint16_t>(word & 0x6F) | 0xFF90)) << word;
    const bool fault = (word & 0x4F) == 0x08 || (word & 0x4F) == 0x0F;
    EXPECT_EQ(fault, state == DriveState::kFault || state == DriveState::kFaultReaction) << word;
    EXPECT_EQ((word & 0x6F) == 0x27, state == DriveState::kOperationEnabled) << word;
  }
  EXPECT_EQ(seen.size(), idl::Enumeration<DriveState>::entries.size());
}

TEST(Cia402, ManualStatuswordsAreRead) {
  // Statuswords from drive manuals.
  EXPECT_EQ(driveState(0x0250), DriveState::kSwitchOnDisabled);
  EXPECT_EQ(driveState(0x0231), DriveState::kReadyToSwitchOn);
  EXPECT_EQ(driveState(0x0233), DriveState::kSwitchedOn);
  EXPECT_EQ(driveState(0x1237), DriveState::kOperationEnabled);
  EXPECT_EQ(driveState(0x0217), DriveState::kQuickStopActive);
  EXPECT_EQ(driveState(0x0218), DriveState::kFault);
}

TEST(Cia402, FromAnyStateToAnyGoalWithoutSkippingAState) {
  for (std::uint32_t run = 0; run < 500; ++run) {
    SCOPED_TRACE(test::trace(test::baseSeed() + run));
    Random random(test::baseSeed() + run);
    ProfileDrive drive;
    constexpr DriveState kStarts[] = {DriveState::kSwitchOnDisabled, DriveState::kReadyToSwitchOn,
                                      DriveState::kSwitchedOn, DriveState::kOperationEnabled,
                                      DriveState::kQuickStopActive};
    drive.state = kStarts[random.integer(0, 4)];
    PowerSequence sequence(0.1, 0.1);
    const PowerGoal goal = random.chance(0.5) ? PowerGoal::kOperation : PowerGoal::kOff;
    std::int64_t now = 1'000'000'000;
    sequence.setGoal(goal, now);
    int cycles = 0;
    for (; cycles < 100; ++cycles, now += 1'000'000) {
      const std::uint16_t word = sequence.step(driveState(drive.statusword()), true, now);
      EXPECT_FALSE(sequence.late(now));
      if (sequence.reached())
        break;
      if (random.chance(0.7))  // some commands are lost or delayed
        drive.take(word);
    }
    EXPECT_TRUE(sequence.reached()) << "in state " << name(drive.state);
  }
}

TEST(Cia402, TorqueGoesOnlyWhenItMayOrItsBudgetIsOver) {
  constexpr double kStopBudget = 0.3;
  for (const std::uint16_t start : {0x0027, 0x0007}) {  // in operation, in its quick stop
    PowerSequence sequence(0.1, kStopBudget);
    sequence.setGoal(PowerGoal::kOperation, 0);
    sequence.step(driveState(0x0027), false, 1'000'000);
    sequence.setGoal(PowerGoal::kOff, 1'000'000);
    for (std::int64_t now = 2'000'000; now < 300'000'000; now += 4'000'000) {
      EXPECT_EQ(sequence.step(driveState(start), false, now), controlword::kQuickStop) << now;
      EXPECT_FALSE(sequence.late(now));
    }
    EXPECT_EQ(sequence.step(driveState(start), false, 320'000'000), controlword::kDisableVoltage);
    EXPECT_TRUE(sequence.late(420'000'000));
  }
  PowerSequence sequence(0.1, kStopBudget);
  EXPECT_EQ(sequence.step(driveState(0x0027), false, 0), controlword::kQuickStop) << "found in operation";
  EXPECT_EQ(sequence.step(driveState(0x0027), true, 1), controlword::kSwitchOn);
  EXPECT_EQ(sequence.step(driveState(0x0007), true, 2), controlword::kDisableVoltage);
}

TEST(Cia402, NoGoalLeavesAFaultWithoutAReset) {
  for (const PowerGoal goal : {PowerGoal::kOff, PowerGoal::kOperation}) {
    PowerSequence sequence(0.1, 0.1);
    sequence.setGoal(goal, 0);
    for (int i = 0; i < 50; ++i) {
      EXPECT_EQ(sequence.step(driveState(0x0008), true, i), controlword::kDisableVoltage);
      EXPECT_NE(sequence.reached(), goal == PowerGoal::kOperation);
    }
  }
}

TEST(Cia402, AResetWritesZeroBeforeTheEdgeAndEndsWithTheFault) {
  ProfileDrive drive;
  drive.state = DriveState::kFault;
  drive.take(0x80);  // bit 7 was already high: only an edge counts
  drive.state = DriveState::kFault;
  PowerSequence sequence(0.1, 0.1);
  sequence.step(driveState(drive.statusword()), true, 0);
  sequence.resetFault(0);
  bool low = false;
  for (int i = 1; i < 20 && drive.state == DriveState::kFault; ++i) {
    const std::uint16_t word = sequence.step(driveState(drive.statusword()), true, i);
    low = low || word == 0;
    EXPECT_TRUE(low || (word & controlword::kFaultReset) == 0);
    drive.take(word);
  }
  EXPECT_EQ(drive.state, DriveState::kSwitchOnDisabled);
  EXPECT_EQ(sequence.step(driveState(drive.statusword()), true, 30) & controlword::kFaultReset, 0);
}

TEST(Cia402, SlowStateTransitionTimesOut) {
  PowerSequence sequence(0.1, 0.1);
  sequence.step(driveState(0x0040), true, 0);
  sequence.setGoal(PowerGoal::kOperation, 0);
  sequence.step(driveState(0x0021), true, 50'000'000);
  EXPECT_FALSE(sequence.late(140'000'000));
  sequence.step(driveState(0x0021), true, 140'000'000);
  EXPECT_TRUE(sequence.late(151'000'000));
}

TEST(Cia402, HomingBitsFollowTheTable) {
  const auto word = [](int b13, int b12, int b10) {
    return static_cast<std::uint16_t>(b13 << 13 | b12 << 12 | b10 << 10 | 0x27);
  };
  EXPECT_EQ(homingState(word(0, 0, 0)), HomingState::kRunning);
  EXPECT_EQ(homingState(word(0, 0, 1)), HomingState::kInterrupted);
  EXPECT_EQ(homingState(word(0, 1, 0)), HomingState::kAttainedMoving);
  EXPECT_EQ(homingState(word(0, 1, 1)), HomingState::kDone);
  EXPECT_EQ(homingState(word(1, 0, 0)), HomingState::kErrorMoving);
  EXPECT_EQ(homingState(word(1, 0, 1)), HomingState::kErrorStanding);
}

TEST(Cia402, ASetPointCountsOncePerEdge) {
  SetPointHandshake handshake;
  EXPECT_EQ(handshake.step(0x0027), 0);
  handshake.request();
  const std::uint16_t acknowledge = 0x1027;
  EXPECT_EQ(handshake.step(acknowledge), 0) << "bit 4 rose while the last set-point was still acknowledged";
  EXPECT_EQ(handshake.step(0x0027), controlword::kNewSetPoint);
  EXPECT_EQ(handshake.step(0x0027), controlword::kNewSetPoint);
  EXPECT_EQ(handshake.step(acknowledge), 0);
  EXPECT_TRUE(handshake.idle());
}

TEST(Cia402, ModesAndCodesInWords) {
  EXPECT_TRUE(supports(1u << 7, DriveMode::kCyclicPosition));
  EXPECT_FALSE(supports(1u << 7, DriveMode::kHoming));
  EXPECT_FALSE(supports(0xFFFFFFFF, DriveMode::kNone));
  EXPECT_EQ(describeErrorCode(0x8611), "following error (0x8611)");
  EXPECT_EQ(describeErrorCode(0x3299), "voltage (0x3299)");
  EXPECT_EQ(describeErrorCode(0xFF03), "specific to the manufacturer (0xFF03)");
  EXPECT_EQ(describeErrorCode(0), "no error");
}

}  // namespace
}  // namespace tandem::hal
