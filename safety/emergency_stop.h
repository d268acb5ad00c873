// SPDX-License-Identifier: Apache-2.0
/** @file Emergency stop as read back by the drive side: it acts in hardware; here it is reported and latched. */
#pragma once

#include <cstdint>

#include "idl/enumerations.h"
#include "safety/faults.h"
#include "safety/watchdog.h"

namespace tandem::safety {

using idl::EmergencyStop;

/// Fault that the emergency stop latches on every arm.
inline constexpr FaultRecord kEmergencyStopRecord{bit(Fault::kStopRequested), FaultCause::kEmergencyStop};

/// Faults whose cause is still present, with the emergency stop as the cause: the others probably follow from it.
/// @param pressed  false: it cannot be read, and what failed there is the cause
inline FaultRecord withEmergencyStop(const FaultRecord& present, bool active, bool pressed = true) noexcept {
  if (!active)
    return present;
  const bool other_cause = !pressed && present.cause != FaultCause::kUnspecified;
  FaultRecord record = other_cause ? present : kEmergencyStopRecord;
  record.faults |= present.faults | kEmergencyStopRecord.faults;
  return record;
}

/** Emergency stop reported periodically by another device, for example the controller of the cell. A time-out after the
 * first report counts as pressed. Times are ns on the caller's clock. */
class EmergencyReports {
 public:
  /// @param budget longest time between two reports, s; 0: no reports are expected.
  explicit EmergencyReports(double budget) : watchdog_(budget), asked_(budget > 0.0) {}

  void take(bool pressed, std::int64_t now) noexcept {
    watchdog_.feed(now);
    received_ = true;
    pressed_ = pressed;
  }
  bool asked() const noexcept { return asked_; }
  bool received() const noexcept { return received_; }
  bool pressed() const noexcept { return asked_ && pressed_; }
  bool silent(std::int64_t now) const noexcept { return asked_ && received_ && watchdog_.expired(now); }
  bool active(std::int64_t now) const noexcept { return pressed() || silent(now); }

 private:
  Watchdog watchdog_;
  bool asked_;
  bool received_ = false;
  bool pressed_ = false;
};

}  // namespace tandem::safety
