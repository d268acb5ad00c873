// SPDX-License-Identifier: Apache-2.0
/** @file Torque release of a joint that has to stop: at standstill, or earlier if the joint does not slow down. */
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "hal/hardware.h"
#include "hal/nanoseconds.h"

namespace tandem::hal {

/** Torque of a joint goes off at standstill, or if the joint does not slow down from its greatest speed within kPart of
 * the ramp: then the torque itself drives it. If the drive is silent, the speed is not known, and its ramp continues.
 * Nothing allocates, locks or throws; times are ns on the caller's clock. */
class TorqueRelease {
 public:
  /// @param period  of the feedback, s
  TorqueRelease(const AxisConfig& axis, double period) noexcept
      : fastest_(axis.velocity), deceleration_(axis.quick_stop_deceleration), period_(period) {}

  /// Once per period. @param braking  the drive has torque and has to lose it. @param velocity  m/s or rad/s.
  /// @param fresh  the velocity is of this period.
  bool runsAway(bool braking, double velocity, bool fresh, std::int64_t now) noexcept {
    constexpr double kPart = 0.3;   // of the ramp; after it, a stopping joint has lost the same share of its speed
    constexpr double kSlow = 0.05;  // of the maximum speed: below it, the stop budget is sufficient
    constexpr double kSilenceBudget = 0.020;  // longest time until a quick stop shows an effect, s
    const double speed = std::abs(velocity);
    if (!braking || speed > 1.05 * from_) {
      since_ = now;
      from_ = speed;
    }
    const double timeout = std::max({kSilenceBudget, 5.0 * period_, kPart * from_ / deceleration_});
    const bool no_slower = speed > std::max(0.9 * from_, kSlow * fastest_);
    return fresh && now - since_ > nanoseconds(timeout) && no_slower;
  }

 private:
  double fastest_, deceleration_, period_;
  std::int64_t since_ = 0;  ///< time since which the drive has to stop and lose its torque
  double from_ = 0.0;       ///< speed at that time, m/s or rad/s
};

}  // namespace tandem::hal
