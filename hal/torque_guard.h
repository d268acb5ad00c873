// SPDX-License-Identifier: Apache-2.0
/** @file Torque guard: torque or current of an axis against its limit. */
#pragma once

#include <cmath>
#include <cstdint>

#include "hal/hardware.h"
#include "hal/nanoseconds.h"

namespace tandem::hal {

/** Watches the torque or current of one drive. Nothing allocates, locks or throws; times are ns on the caller's clock.
 */
class TorqueGuard {
 public:
  explicit TorqueGuard(const TorqueLimit& limit)
      : watches_(limit.object != 0), most_(limit.limit), time_(nanoseconds(limit.time)) {}

  bool watches() const noexcept { return watches_; }
  /// Discards earlier readings.
  void reset() noexcept { since_ = 0; }
  /// A new reading, share of the rated torque or current.
  void take(double reading, std::int64_t now) noexcept {
    if (std::abs(reading) <= most_) {
      since_ = 0;
    } else if (since_ == 0) {
      since_ = now;
    }
  }
  /// The torque has been above the limit without interruption for the permitted time.
  bool exceeded(std::int64_t now) const noexcept { return since_ != 0 && now - since_ >= time_; }

 private:
  bool watches_;
  double most_;  ///< share of the rated torque or current
  std::int64_t time_;
  std::int64_t since_ = 0;  ///< start of the time above the limit, 0: below
};

}  // namespace tandem::hal
