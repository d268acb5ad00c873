// SPDX-License-Identifier: Apache-2.0
/** @file Holding brake that the HAL controls by an output of the drive. */
#pragma once

#include <cstdint>

#include "hal/axis_driver.h"
#include "hal/hardware.h"

namespace tandem::hal {

/** Opens the brake once torque holds the joint; closes it before torque goes off, or at once if torque is lost. Each
 * change is confirmed by the drive. Slip is the motion of a joint behind its closed brake without
 * torque. It is monitored as long as there is no torque, so that a brake that slips prevents power on. Nothing after
 * construction allocates, locks or throws; times are ns. */
class Brake {
 public:
  explicit Brake(const BrakeConfig& config) noexcept : config_(config) {}

  /// The drive was booted: its setup has closed the brake at `now`.
  void restart(std::int64_t now) noexcept;

  /** Once per period, while the drive is up.
   * @param open requested state
   * @param torque whether the drive holds the joint
   * @param position of the joint, m or rad
   * @return false after a failed change, or after slip. */
  bool step(bool open, bool torque, double position, AxisDriver& driver, std::int64_t now) noexcept;

  /// The brake holds: torque may go off.
  bool closed(std::int64_t now) const noexcept { return elapsed(now, config_.closing_time) && !open_; }
  /// The brake is open: the joint can move.
  bool opened(std::int64_t now) const noexcept { return elapsed(now, config_.opening_time) && open_; }

 private:
  bool elapsed(std::int64_t now, double time) const noexcept {
    return !writing_ && 1e-9 * static_cast<double>(now - since_) >= time;
  }

  BrakeConfig config_;
  bool open_ = false;     ///< as last written
  bool writing_ = false;  ///< the drive has not confirmed it yet
  bool obeys_ = true;
  bool holding_ = false;  ///< closed and without torque: held_ counts
  double held_ = 0.0;     ///< joint position when torque went off, m or rad
  std::int64_t since_ = 0;
};

}  // namespace tandem::hal
