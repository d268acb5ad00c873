// SPDX-License-Identifier: Apache-2.0
/** @file Joint position by an absolute encoder, also by one whose counts begin again after a range (single-turn). */
#pragma once

#include <cmath>
#include <cstdint>

#include "hal/hardware.h"

namespace tandem::hal {

/** Converts readings to joint positions. With EncoderConfig::range, the first reading after restart() is the place that
 * is nearest to the middle of the axis' limits, and each further one the nearest to that before. Nothing allocates,
 * locks or throws. */
class EncoderReading {
 public:
  EncoderReading() = default;
  /// @param lower, upper  limits of the axis; with a range they must be closer than it
  /// @throw std::invalid_argument as AxisUnits does
  EncoderReading(const EncoderConfig& encoder, double lower, double upper)
      : units_(encoder.gearing), range_(units_.resolution() * encoder.range), last_(0.5 * (lower + upper)) {
    middle_ = last_;
  }

  /// The encoder may have turned meanwhile.
  void restart() noexcept { last_ = middle_; }
  /// @param counts  object 6004, or 60E4 of the drive @return m or rad
  double take(std::int32_t counts) noexcept {
    const double place = units_.toJoint(counts);
    last_ = range_ > 0.0 ? place + range_ * std::round((last_ - place) / range_) : place;
    return last_;
  }

 private:
  AxisUnits units_;
  double range_ = 0.0;  ///< m or rad; 0: the counts never begin again
  double middle_ = 0.0, last_ = 0.0;
};

}  // namespace tandem::hal
