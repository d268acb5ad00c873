// SPDX-License-Identifier: Apache-2.0
/** @file Limit switches of a joint that its drive reads. */
#pragma once

#include "idl/enumerations.h"

namespace tandem::hal {

using idl::LimitSwitch;

/** A joint in operation may leave an active limit switch, and not go farther. So a target is too far if it is beyond
 * the place at which the switch became active; or beyond that at which operation began, for a joint that stood on the
 * switch before. Nothing allocates, locks or throws; positions in m or rad. */
class LimitSwitches {
 public:
  /// @param slack  within which positions are the same place
  explicit LimitSwitches(double slack) noexcept : slack_(slack) {}

  /// A new sample. @param lower,upper  the switch of this direction is active
  void take(bool lower, bool upper, double position, bool operating) noexcept {
    lower_.take(lower, position, operating);
    upper_.take(upper, position, operating);
  }
  LimitSwitch active() const noexcept {
    return static_cast<LimitSwitch>((lower_.active ? 1 : 0) | (upper_.active ? 2 : 0));
  }
  bool beyond(double target) const noexcept {
    return (lower_.active && target < lower_.place - slack_) || (upper_.active && target > upper_.place + slack_);
  }

 private:
  struct Switch {
    bool active = false;
    double place = 0.0;
    void take(bool now, double position, bool operating) noexcept {
      place = active && operating ? place : position;
      active = now;
    }
  };
  double slack_;
  Switch lower_, upper_;
};

}  // namespace tandem::hal
