// SPDX-License-Identifier: Apache-2.0
/** @file First-motion check of an axis after boot: compares distance and direction of its travel with the command. */
#pragma once

#include <algorithm>
#include <cmath>

namespace tandem::hal {

/** Compares travel, not speed: a wrong unit, gearing or sign of a hardware file is wrong in its speed limits, too.
 * Until the joint has travelled kEnough times `slack` in accordance with its targets, two distances must stay within
 * `slack`:
 *
 *   the distance of the joint from the range of all targets since the start of the motion (a joint that lags stays
 *   inside, whatever its speed; one that goes too far, or the wrong way, leaves it);
 *   |travel of the absolute encoder - travel of the drive|, if there is an encoder.
 *
 * Nothing allocates, locks or throws; positions in m or rad. */
class FirstMotion {
 public:
  /// @param slack  AxisConfig::first_motion
  explicit FirstMotion(double slack) noexcept : slack_(slack) {}

  /// The axis was booted: its next motion is the first one.
  void restart() noexcept { confirmed_ = false; }
  /// A motion starts here; a joint without encoder passes the drive's position twice.
  void begin(double target, double drive, double encoder) noexcept {
    least_ = most_ = target;
    difference_ = encoder - drive;
    farthest_ = excess_ = 0.0;
    from_ = drive;
  }
  void sample(double target, double drive, double encoder) noexcept { sample(target, target, drive, encoder); }
  /// @param least,most  of several targets
  void sample(double least, double most, double drive, double encoder) noexcept {
    if (confirmed_)
      return;
    least_ = std::min(least_, least);
    most_ = std::max(most_, most);
    const double outside = std::max({least_ - drive, drive - most_, 0.0});
    excess_ = std::max({excess_, outside, std::abs(encoder - drive - difference_)});
    farthest_ = std::max(farthest_, std::abs(drive - from_));
    confirmed_ = !failed() && farthest_ >= kEnough * slack_;
  }

  /// The motion is not as commanded; until the next begin().
  bool failed() const noexcept { return excess_ > slack_; }
  /// The larger of both distances, its maximum since begin(), m or rad.
  double excess() const noexcept { return excess_; }
  bool confirmed() const noexcept { return confirmed_; }

  static constexpr double kEnough = 10.0;

 private:
  double slack_;
  double least_ = 0.0, most_ = 0.0;  ///< range of the targets
  double difference_ = 0.0;          ///< encoder minus drive at the start
  double from_ = 0.0, farthest_ = 0.0;
  double excess_ = 0.0;
  bool confirmed_ = false;
};

}  // namespace tandem::hal
