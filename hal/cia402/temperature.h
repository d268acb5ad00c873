// SPDX-License-Identifier: Apache-2.0
/** @file Temperature of a drive. */
#pragma once

#include <cstdint>
#include <limits>

#include "hal/cia402/sdo_jobs.h"
#include "hal/hardware.h"

namespace tandem::hal {

/** Reads the object with a drive's temperature once a second. Nothing allocates, locks or throws; times are ns. */
class Temperature {
 public:
  explicit Temperature(const AxisConfig& config) noexcept
      : object_{config.temperature_index, config.temperature_sub}, scale_(config.temperature_scale) {}

  /// The node was booted.
  void restart() noexcept { jobs_.clear(); }
  /// It uses the node's SDO client.
  bool reading() const noexcept { return jobs_.status() == SdoJobs::Status::kBusy; }
  /// Once per period. @param free the node's SDO client is not in use.
  void step(bool free, canopen::Node& node, std::int64_t now) noexcept;
  /// Degrees Celsius; NaN: not known.
  double value() const noexcept { return value_; }

 private:
  canopen::ObjectAddress object_;
  double scale_;
  SdoJobs jobs_;
  std::int64_t next_ = 0;  ///< time of the next reading, ns
  double value_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace tandem::hal
