// SPDX-License-Identifier: Apache-2.0
#include "hal/hard_stop_search.h"

#include <algorithm>
#include <cmath>

#include "hal/nanoseconds.h"

namespace tandem::hal {

HardStopSearch::HardStopSearch(const AxisConfig& axis, double period) noexcept
    : direction_(axis.hard_stop.positive ? 1.0 : -1.0),
      fastest_(axis.hard_stop.speed),
      acceleration_(std::min(axis.slew_limit, axis.quick_stop_deceleration)),
      period_(period),
      limit_(kPushing * axis.hard_stop.torque),
      lead_(0.5 * axis.following_error),
      range_(1.1 * (axis.upper - axis.lower)),
      slack_(std::max(0.1 * axis.hard_stop.speed * axis.hard_stop.time, 2.0 * AxisUnits(axis.gearing).resolution())),
      leads_(axis.mode == DriveMode::kCyclicPosition),
      time_(nanoseconds(axis.hard_stop.time)) {}

void HardStopSearch::start(std::int64_t now) noexcept {
  speed_ = target_ = contact_ = 0.0;
  since_ = now;
  found_ = lost_ = false;
}

void HardStopSearch::step(double position, double torque, std::int64_t now) noexcept {
  if (found_ || lost_)
    return;
  const bool pushes = std::abs(torque) >= limit_;
  if (!pushes || std::abs(position - contact_) > slack_) {
    contact_ = position;
    since_ = now;
  }
  found_ = now - since_ >= time_;
  lost_ = direction_ * position > range_;
  if (found_ || lost_) {
    target_ = contact_ = position;
    return;
  }
  speed_ = std::min(fastest_, speed_ + acceleration_ * period_);
  const double ahead = std::min(direction_ * (target_ - position) + speed_ * period_, lead_);
  target_ = leads_ ? position + direction_ * ahead : position;
}

}  // namespace tandem::hal
