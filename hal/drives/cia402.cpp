// SPDX-License-Identifier: Apache-2.0
#include "hal/drives/cia402.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

namespace tandem::hal {

DriveState driveState(std::uint16_t statusword) noexcept {
  switch (statusword & 0x4F) {
    case 0x00:
      return DriveState::kNotReady;
    case 0x40:
      return DriveState::kSwitchOnDisabled;
    case 0x0F:
      return DriveState::kFaultReaction;
    case 0x08:
      return DriveState::kFault;
    default:
      break;
  }
  switch (statusword & 0x6F) {
    case 0x21:
      return DriveState::kReadyToSwitchOn;
    case 0x23:
      return DriveState::kSwitchedOn;
    case 0x27:
      return DriveState::kOperationEnabled;
    case 0x07:
      return DriveState::kQuickStopActive;
    default:
      return DriveState::kUnknown;
  }
}

std::string_view name(DriveMode mode) {
  switch (mode) {
    case DriveMode::kNone:
      return "none";
    case DriveMode::kProfilePosition:
      return "profile position";
    case DriveMode::kProfileVelocity:
      return "profile velocity";
    case DriveMode::kHoming:
      return "homing";
    case DriveMode::kCyclicPosition:
      return "cyclic synchronous position";
    case DriveMode::kCyclicVelocity:
      return "cyclic synchronous velocity";
  }
  return "unknown";
}

bool supports(std::uint32_t supported_modes, DriveMode mode) noexcept {
  const int number = static_cast<int>(mode);
  return number > 0 && (supported_modes >> (number - 1) & 1u) != 0;
}

void PowerSequence::setGoal(PowerGoal goal, std::int64_t now) noexcept {
  if (goal == goal_)
    return;
  goal_ = goal;
  timeout_.feed(now);
}

void PowerSequence::resetFault(std::int64_t now) noexcept {
  if (state_ != DriveState::kFault || reset_ != Reset::kNone)
    return;
  reset_ = Reset::kLow;
  low_cycles_ = 0;
  timeout_.feed(now);
}

bool PowerSequence::reached() const noexcept {
  switch (goal_) {
    case PowerGoal::kOperation:
      return state_ == DriveState::kOperationEnabled;
    case PowerGoal::kOff:
      return state_ == DriveState::kSwitchOnDisabled || state_ == DriveState::kNotReady ||
             (state_ == DriveState::kFault && reset_ == Reset::kNone);
  }
  return false;
}

std::uint16_t PowerSequence::towardsOperation() const noexcept {
  switch (state_) {
    case DriveState::kSwitchOnDisabled:
      return controlword::kShutdown;
    case DriveState::kReadyToSwitchOn:
      return controlword::kSwitchOn;
    case DriveState::kSwitchedOn:
    case DriveState::kOperationEnabled:
      return controlword::kEnableOperation;
    default:
      return controlword::kDisableVoltage;  // leaves the quick stop through switch on disabled
  }
}

std::uint16_t PowerSequence::towardsOff(bool may_release) const noexcept {
  switch (state_) {
    case DriveState::kOperationEnabled:
      // Disable operation: a drive that controls its brake closes it before the current goes off.
      return may_release ? controlword::kSwitchOn : controlword::kQuickStop;
    case DriveState::kQuickStopActive:
      return may_release ? controlword::kDisableVoltage : controlword::kQuickStop;
    case DriveState::kFaultReaction:
      return controlword::kQuickStop;  // the drive's own ramp runs
    case DriveState::kSwitchedOn:
      return controlword::kShutdown;
    default:
      return controlword::kDisableVoltage;
  }
}

std::uint16_t PowerSequence::step(DriveState state, bool may_release, std::int64_t now) noexcept {
  if (state != state_)
    timeout_.feed(now);
  const bool was_braking = braking();
  state_ = state;
  if (!braking() || !was_braking) {
    stop_.feed(now);
    late_stop_.feed(now);
  }
  if (state_ != DriveState::kFault)
    reset_ = Reset::kNone;
  if (reset_ == Reset::kLow && ++low_cycles_ > kLowCycles)
    reset_ = Reset::kHigh;
  if (reset_ == Reset::kHigh)
    return controlword::kFaultReset;
  if (reset_ == Reset::kLow || state_ == DriveState::kFault)
    return controlword::kDisableVoltage;
  if (goal_ == PowerGoal::kOperation)
    return towardsOperation();
  return stop_.expired(now) ? controlword::kDisableVoltage : towardsOff(may_release);
}

HomingState homingState(std::uint16_t word) noexcept {
  const bool reached = (word & statusword::kTargetReached) != 0;
  if ((word & statusword::kHomingError) != 0)
    return reached ? HomingState::kErrorStanding : HomingState::kErrorMoving;
  if ((word & statusword::kHomingAttained) != 0)
    return reached ? HomingState::kDone : HomingState::kAttainedMoving;
  return reached ? HomingState::kInterrupted : HomingState::kRunning;
}

std::uint16_t SetPointHandshake::step(std::uint16_t word) noexcept {
  const bool acknowledged = (word & statusword::kSetPointAcknowledge) != 0;
  if (raised_ && acknowledged)
    raised_ = false;
  if (pending_ && !raised_ && !acknowledged) {
    pending_ = false;
    raised_ = true;
  }
  return raised_ ? controlword::kNewSetPoint : 0;
}

namespace {

struct ErrorCode {
  std::uint16_t code;
  const char* text;
};

constexpr std::array kErrorCodes{
    ErrorCode{0x2310, "continuous over-current"},
    ErrorCode{0x2320, "short circuit"},
    ErrorCode{0x2350, "over-current, thermal model (I2t)"},
    ErrorCode{0x3110, "mains over-voltage"},
    ErrorCode{0x3120, "mains under-voltage"},
    ErrorCode{0x3210, "DC link over-voltage"},
    ErrorCode{0x3220, "DC link under-voltage"},
    ErrorCode{0x4210, "over-temperature of the device"},
    ErrorCode{0x4310, "over-temperature of the drive"},
    ErrorCode{0x5530, "parameter memory"},
    ErrorCode{0x6320, "parameter error"},
    ErrorCode{0x7121, "motor blocked"},
    ErrorCode{0x7305, "encoder 1"},
    ErrorCode{0x7306, "encoder 2"},
    ErrorCode{0x7500, "communication"},
    ErrorCode{0x8110, "CAN overrun, frames lost"},
    ErrorCode{0x8120, "CAN error passive"},
    ErrorCode{0x8130, "heartbeat or life guard lost"},
    ErrorCode{0x8140, "recovered from bus-off"},
    ErrorCode{0x8150, "CAN identifier collision"},
    ErrorCode{0x8210, "PDO too short, not processed"},
    ErrorCode{0x8220, "PDO longer than mapped"},
    ErrorCode{0x8240, "SYNC of unexpected length"},
    ErrorCode{0x8250, "RPDO time-out"},
    ErrorCode{0x8611, "following error"},
    ErrorCode{0x8612, "position beyond the reference limit"},
};

constexpr std::array kErrorClasses{
    ErrorCode{0x1000, "generic error"},
    ErrorCode{0x2000, "current"},
    ErrorCode{0x3000, "voltage"},
    ErrorCode{0x4000, "temperature"},
    ErrorCode{0x5000, "device hardware"},
    ErrorCode{0x6000, "device software"},
    ErrorCode{0x7000, "additional modules"},
    ErrorCode{0x8000, "monitoring"},
    ErrorCode{0x9000, "external error"},
    ErrorCode{0xF000, "additional functions"},
};

}  // namespace

std::string describeErrorCode(std::uint16_t code) {
  if (code == 0)
    return "no error";
  const char* text = "unknown error";
  const auto known =
      std::find_if(kErrorCodes.begin(), kErrorCodes.end(), [&](const auto& e) { return e.code == code; });
  const auto kind = std::find_if(kErrorClasses.begin(), kErrorClasses.end(),
                                 [&](const auto& e) { return e.code == (code & 0xF000); });
  if (known != kErrorCodes.end()) {
    text = known->text;
  } else if (code >= 0xFF00) {
    text = "specific to the manufacturer";
  } else if (kind != kErrorClasses.end()) {
    text = kind->text;
  }
  std::array<char, 80> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%s (0x%04X)", text, code);
  return buffer.data();
}

}  // namespace tandem::hal
