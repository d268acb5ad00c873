// SPDX-License-Identifier: Apache-2.0
#include "hal/guards.h"

#include <utility>

namespace tandem::hal {

std::string describeGuards(GuardMask guards) {
  std::string text;
  for (int g = 0; g < kHardwareGuardCount; ++g) {
    const auto guard = static_cast<HardwareGuard>(g);
    if ((guards & bit(guard)) == 0)
      continue;
    text += text.empty() ? "" : ", ";
    text += name(guard);
  }
  return text.empty() ? "none" : text;
}

std::string_view describe(HomingFailure failure) {
  switch (failure) {
    case HomingFailure::kSetup:
      return "the drive has not taken an object of the run: compare `method` with its manual (tandem can import)";
    case HomingFailure::kDrive:
      return "the drive reports an error of its run (6041, bit 13): check its switches and `method`";
    case HomingFailure::kPowerOff:
      return "the drive left operation during the run";
    case HomingFailure::kLate:
      return "the run has not ended within `budget`: check the switch or the stop, the speed and `budget`";
    case HomingFailure::kNoStop:
      return "the joint moved 1.1 times its range without a stop: check `direction`, the stop and the coupling";
    case HomingFailure::kNone:
      break;
  }
  return {};
}

safety::FaultRecord faultOf(GuardMask guards) noexcept {
  using safety::FaultCause;
  // In causal order: a cause comes before its consequences.
  static constexpr std::pair<GuardMask, FaultCause> kCauses[] = {
      {bit(HardwareGuard::kForeignMaster), FaultCause::kForeignMaster},
      {bit(HardwareGuard::kNode) | bit(HardwareGuard::kDriveSilent) | bit(HardwareGuard::kEncoderSilent) |
           bit(HardwareGuard::kBus),
       FaultCause::kNoAnswer},
      {bit(HardwareGuard::kDriveFault) | bit(HardwareGuard::kEmergency) | bit(HardwareGuard::kEncoderAlarm),
       FaultCause::kDeviceError},
      {bit(HardwareGuard::kEncoderMismatch), FaultCause::kDisagree},
      {bit(HardwareGuard::kFollowing) | bit(HardwareGuard::kFirstMotion), FaultCause::kFollowingError},
      {bit(HardwareGuard::kOverspeed), FaultCause::kOverspeed},
      {bit(HardwareGuard::kInternalLimit), FaultCause::kOutsideLimits},
      {bit(HardwareGuard::kBrake), FaultCause::kBrake},
      {bit(HardwareGuard::kTorque), FaultCause::kTorque},
      {bit(HardwareGuard::kPowerLost), FaultCause::kOff},
      {bit(HardwareGuard::kFramesLost), FaultCause::kLost},
  };
  safety::FaultRecord record;
  if ((guards & kSensorGuards) != 0)
    record.faults |= bit(safety::Fault::kSensor);
  if ((guards & bit(HardwareGuard::kEmergencyStop)) != 0)
    record.faults |= bit(safety::Fault::kStopRequested);
  if ((guards & ~kSensorGuards & ~bit(HardwareGuard::kEmergencyStop)) != 0)
    record.faults |= bit(safety::Fault::kDrive);
  for (const auto& [those, cause] : kCauses) {
    if ((guards & those) != 0) {
      record.cause = cause;
      break;
    }
  }
  return record;
}

void HardwareGuardCounters::add(GuardMask began, int arm, int joint) noexcept {
  for (int g = 0; g < kHardwareGuardCount; ++g) {
    if ((began & (1u << g)) == 0)
      continue;
    Entry& entry = entries_[static_cast<std::size_t>(g)];
    ++entry.count;
    entry.arm = static_cast<std::uint8_t>(arm);
    entry.joint = static_cast<std::uint8_t>(joint);
  }
}

}  // namespace tandem::hal
