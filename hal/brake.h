// SPDX-License-Identifier: Apache-2.0
/** @file Holding brake that the HAL controls by a digital output of the drive. */
#pragma once

#include <cstdint>

#include "hal/canopen/node.h"
#include "hal/hardware.h"
#include "hal/sdo_jobs.h"

namespace tandem::hal {

/** Opens the brake where torque holds the joint, and closes it before torque goes, or at once where it is gone. Each
 * change is written to object 0x60FE:1 and read back. What a joint moves behind the closed brake without torque is its
 * slip: it is looked at as long as there is no torque, so that no torque is asked for, and no brake opened, on the
 * strength of one that does not hold. Nothing after construction allocates, locks or throws; times are ns. */
class Brake {
 public:
  explicit Brake(const BrakeConfig& config) noexcept : config_(config) {}

  /// The node was booted: its setup has closed the brake, `now`.
  void restart(std::int64_t now) noexcept;

  /** Once per period, while the node is operational.
   * @param open whether it shall be open
   * @param torque whether the drive holds the joint
   * @param position of the joint, m or rad
   * @param free nobody else uses the node's SDO client
   * @return false once it does not obey, or has slipped. */
  bool step(bool open, bool torque, double position, bool free, canopen::Node& node, std::int64_t now) noexcept;
  /// It uses the node's SDO client.
  bool writing() const noexcept { return writing_; }

  /// It holds: torque may go.
  bool closed(std::int64_t now) const noexcept { return elapsed(now, config_.closing_time) && !open_; }
  /// It lets the joint move.
  bool opened(std::int64_t now) const noexcept { return elapsed(now, config_.opening_time) && open_; }

 private:
  bool elapsed(std::int64_t now, double time) const noexcept {
    return !writing_ && 1e-9 * static_cast<double>(now - since_) >= time;
  }

  BrakeConfig config_;
  SdoJobs jobs_;
  bool open_ = false;     ///< as last written
  bool writing_ = false;  ///< the node has not confirmed it yet
  bool obeys_ = true;
  bool holding_ = false;  ///< closed and without torque: held_ counts
  double held_ = 0.0;     ///< where the joint was when torque went, m or rad
  std::int64_t since_ = 0;
};

}  // namespace tandem::hal
