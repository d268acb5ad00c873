// SPDX-License-Identifier: Apache-2.0
/** @file The emergency stop as the drive side reads it back: it acts by hardware; here it is known and latched. */
#pragma once

#include <cstdint>

#include "safety/faults.h"

namespace tandem::safety {

/** What is known of it. tandem_msgs/HalStatus::emergency_stop */
enum class EmergencyStop : std::uint8_t {
  kNotRead = 0,  ///< nothing reads it, or what does cannot be heard
  kReleased,
  kPressed,
};

/// What it latches on every arm.
inline constexpr FaultRecord kEmergencyStopRecord{bit(Fault::kStopRequested), FaultCause::kEmergencyStop};

/// Faults whose cause stands, with the emergency stop, which goes first: others are likely to follow from it.
inline FaultRecord withEmergencyStop(const FaultRecord& present, bool active) noexcept {
  if (!active)
    return present;
  FaultRecord record = kEmergencyStopRecord;
  record.faults |= present.faults;
  return record;
}

}  // namespace tandem::safety
