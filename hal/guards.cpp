// SPDX-License-Identifier: Apache-2.0
#include "hal/guards.h"

namespace tandem::hal {

std::string_view name(HardwareGuard guard) {
  constexpr std::array<std::string_view, kHardwareGuardCount> kNames{"node",
                                                                     "drive_silent",
                                                                     "drive_fault",
                                                                     "emergency",
                                                                     "power_lost",
                                                                     "following",
                                                                     "ignores_command",
                                                                     "switch_on",
                                                                     "encoder_silent",
                                                                     "encoder_alarm",
                                                                     "encoder_mismatch",
                                                                     "reference",
                                                                     "homing",
                                                                     "bus",
                                                                     "overspeed",
                                                                     "internal_limit",
                                                                     "foreign_master",
                                                                     "torque",
                                                                     "brake",
                                                                     "emergency_stop"};
  const auto i = static_cast<std::size_t>(guard);
  return i < kNames.size() ? kNames[i] : std::string_view("unknown");
}

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

safety::FaultMask faultsOf(GuardMask guards) noexcept {
  safety::FaultMask faults = 0;
  if ((guards & kSensorGuards) != 0)
    faults |= safety::bit(safety::Fault::kSensor);
  if ((guards & bit(HardwareGuard::kEmergencyStop)) != 0)
    faults |= safety::bit(safety::Fault::kStopRequested);
  if ((guards & ~kSensorGuards & ~bit(HardwareGuard::kEmergencyStop)) != 0)
    faults |= safety::bit(safety::Fault::kDrive);
  return faults;
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
