// SPDX-License-Identifier: Apache-2.0
/** @file Measured joint speed, from drive feedback alone. */
#pragma once

#include <cstdint>

namespace tandem::hal {

/** Speed from positions that a drive sampled at SYNCs. Decisions need kSamples samples: a single late frame, or a count
 * to and fro, looks like motion. Nothing allocates, locks or throws; times are ns. */
class MeasuredMotion {
 public:
  /** @param fastest maximum speed of the axis, m/s or rad/s */
  MeasuredMotion(double fastest, double resolution, double period) noexcept;

  /// The next sample starts a new history.
  void restart() noexcept;
  /// New sample of the joint position at `time`: counts times the resolution, m or rad.
  void sample(double position, std::int64_t time) noexcept;

  /// Speed between the last two samples, m/s or rad/s; a single count is not motion.
  double velocity() const noexcept { return velocity_; }
  /// The last samples were at standstill: within two counts, or slower than a fiftieth of the maximum speed.
  bool atStandstill() const noexcept { return standing_ >= kSamples; }
  /// The last samples exceeded the maximum speed, with an allowance for a position loop that catches up.
  bool tooFast() const noexcept { return fast_ >= kSamples; }

  static constexpr int kSamples = 3;

 private:
  double fastest_, resolution_, period_;
  double position_ = 0.0;
  std::int64_t time_ = 0;
  bool begun_ = false;
  double velocity_ = 0.0;
  int standing_ = 0;
  int fast_ = 0;
};

}  // namespace tandem::hal
