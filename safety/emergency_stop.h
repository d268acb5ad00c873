// SPDX-License-Identifier: Apache-2.0
/** @file Emergency stop as read back by the drive side: it acts in hardware; here it is reported and latched. */
#pragma once

#include <cstdint>

#include "idl/enumerations.h"
#include "safety/faults.h"
#include "safety/watchdog.h"

namespace tandem::safety {

using idl::EmergencyStop;

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

/** Whoever reads the emergency stop elsewhere, a controller of the cell say, and tells of it again and again. That it
 * falls silent counts as pressed. Times are ns on the caller's clock. */
class EmergencyReports {
 public:
  /// @param budget s within which each report has to follow the one before; 0: nobody is asked.
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
