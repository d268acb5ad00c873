// SPDX-License-Identifier: Apache-2.0
/** @file Homing run against a mechanical stop: finds the position at which the joint stands while the drive pushes. */
#pragma once

#include <cstdint>

#include "hal/hardware.h"

namespace tandem::hal {

/** Target of one axis during the run, and the decision that it is at its stop. Positions are those of the axis since
 * the start of the run (Axis::countFromHere()), m or rad. The target leads the joint by at most half of the following
 * error, so that the drive does not end the run. Nothing allocates, locks or throws; times are ns. */
class HardStopSearch {
 public:
  /// @param period  of step(), s
  HardStopSearch(const AxisConfig& axis, double period) noexcept;

  void start(std::int64_t now) noexcept;
  /// Once per period. @param torque  share of the rated torque, of either sign.
  void step(double position, double torque, std::int64_t now) noexcept;

  /// The stop is found; the target stays at contact().
  bool found() const noexcept { return found_; }
  /// The joint has moved farther than its whole range without a stop.
  bool lost() const noexcept { return lost_; }
  double contact() const noexcept { return contact_; }
  double target() const noexcept { return target_; }
  double velocity() const noexcept { return found_ || lost_ ? 0.0 : direction_ * speed_; }

  /// Share of the torque limit from which the drive counts as pushing: it controls its torque with a ripple.
  static constexpr double kPushing = 0.9;

 private:
  double direction_, fastest_, acceleration_, period_, limit_, lead_, range_, slack_;
  bool leads_;  ///< the drive controls the position; else the target is where the joint is
  std::int64_t time_;
  double speed_ = 0.0;
  double target_ = 0.0;
  double contact_ = 0.0;
  std::int64_t since_ = 0;  ///< of pushing and standing
  bool found_ = false;
  bool lost_ = false;
};

}  // namespace tandem::hal
