// SPDX-License-Identifier: Apache-2.0
/** @file Position of the axis of a simulated drive, as an encoder behind its transmission reads it. */
#pragma once

#include <algorithm>
#include <cstdint>

namespace tandem::sim::drives {

/** An encoder on the axis of a drive. */
struct LoadSpec {
  double ratio = 1.0;       ///< its units per count of the drive; negative: opposite direction
  std::int32_t offset = 0;  ///< units at position 0 of the drive's motor
  std::int64_t range = 0;   ///< units after which it begins again at 0; 0: never
  double play = 0.0;        ///< free travel between motor and encoder, counts of the drive
};

/** Reading of such an encoder. Nothing allocates, locks or throws. */
class LoadPosition {
 public:
  /// @param motor  position of the motor, counts
  LoadPosition(const LoadSpec& spec, double motor) noexcept : spec_(spec), carried_(motor) {}

  /// The motor has moved to this position, counts.
  void follow(double motor) noexcept {
    carried_ = std::clamp(carried_, motor - 0.5 * spec_.play, motor + 0.5 * spec_.play);
  }
  /// Units, without end.
  double position() const noexcept { return spec_.ratio * carried_ + spec_.offset; }
  /// Within the range of the encoder.
  std::int64_t wrapped(std::int64_t reading) const noexcept {
    return spec_.range > 0 ? (reading % spec_.range + spec_.range) % spec_.range : reading;
  }

 private:
  LoadSpec spec_;
  double carried_;  ///< position of the motor that the encoder shows, behind the free travel
};

}  // namespace tandem::sim::drives
