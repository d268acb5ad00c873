// SPDX-License-Identifier: Apache-2.0
/** @file Confirmation that a drive works in the mode that was requested. */
#pragma once

#include <cstdint>

#include "hal/cia402/sdo_jobs.h"
#include "hal/drives/cia402.h"

namespace tandem::hal {

/** Compares the mode of operation display 6061 with the requested mode. Some drives show a new mode only in operation
 * enabled: then it is read there, before the joint may move. Nothing allocates, locks or throws; times are ns. */
class ModeConfirmation {
 public:
  /// A mode was requested. @param confirmed  the drive has shown it.
  void expect(DriveMode mode, bool confirmed) noexcept;
  bool confirmed() const noexcept { return confirmed_; }
  /// It uses the node's SDO client.
  bool reading() const noexcept { return jobs_.status() == SdoJobs::Status::kBusy; }

  /** Once per period. @param operation the drive is in operation enabled. @param free the node's SDO client is not in
   * use. @return false: the drive does not show the mode. */
  bool step(bool operation, bool free, canopen::Node& node, std::int64_t now) noexcept;

 private:
  SdoJobs jobs_;
  DriveMode mode_ = DriveMode::kNone;
  bool confirmed_ = false;
};

}  // namespace tandem::hal
