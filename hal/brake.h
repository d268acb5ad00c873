// SPDX-License-Identifier: Apache-2.0
/** @file Holding brake that the HAL controls by a digital output of the drive. */
#pragma once

#include <cstdint>

#include "hal/canopen/node.h"
#include "hal/hardware.h"
#include "hal/sdo_jobs.h"

namespace tandem::hal {

/** Opens the brake once torque holds the joint; closes it before torque goes off, or at once if torque is lost. Each
 * change is written to object 0x60FE:1 and read back. Slip is the motion of a joint behind its closed brake without
 * torque. It is monitored as long as there is no torque, so that a brake that slips prevents power on. Nothing after
 * construction allocates, locks or throws; times are ns. */
class Brake {
 public:
  explicit Brake(const BrakeConfig& config) noexcept : config_(config) {}

  /// The node was booted: its setup has closed the brake at `now`.
  void restart(std::int64_t now) noexcept;

  /** Once per period, while the node is operational.
   * @param open requested state
   * @param torque whether the drive holds the joint
   * @param position of the joint, m or rad
   * @param free the node's SDO client is not in use
   * @return false after a failed write, or after slip. */
  bool step(bool open, bool torque, double position, bool free, canopen::Node& node, std::int64_t now) noexcept;
  /// The brake uses the node's SDO client.
  bool writing() const noexcept { return writing_; }

  /// The brake holds: torque may go off.
  bool closed(std::int64_t now) const noexcept { return elapsed(now, config_.closing_time) && !open_; }
  /// The brake is open: the joint can move.
  bool opened(std::int64_t now) const noexcept { return elapsed(now, config_.opening_time) && open_; }

 private:
  bool elapsed(std::int64_t now, double time) const noexcept {
    return !writing_ && 1e-9 * static_cast<double>(now - since_) >= time;
  }

  BrakeConfig config_;
  SdoJobs jobs_{true};
  bool open_ = false;     ///< as last written
  bool writing_ = false;  ///< the node has not confirmed it yet
  bool obeys_ = true;
  bool holding_ = false;  ///< closed and without torque: held_ counts
  double held_ = 0.0;     ///< joint position when torque went off, m or rad
  std::int64_t since_ = 0;
};

}  // namespace tandem::hal
