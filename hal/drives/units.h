// SPDX-License-Identifier: Apache-2.0
/** @file Conversion between encoder counts and joint positions (m, rad). */
#pragma once

#include <cstdint>

namespace tandem::hal {

/** Gearing of one axis. Counts are those of object 0x6064 or 0x6004. */
struct Gearing {
  double counts_per_revolution = 0.0;  ///< of the motor or encoder shaft
  double gear_ratio = 1.0;             ///< shaft revolutions per revolution of the output (lead screw or tube)
  double travel_per_revolution = 0.0;  ///< of the output: lead, m, for a translation; 2 pi rad for a rotation
  bool reversed = false;               ///< positive counts move the joint in its negative direction
  double offset = 0.0;                 ///< joint position at zero counts, m or rad
};

/** A position in counts that a 32-bit object can hold, or the nearest one. */
struct Counts {
  std::int32_t value = 0;
  bool exact = true;  ///< false: the position is not finite (value 0) or beyond 32 bits (value at the limit)
};

/** Conversion of one axis: joint = offset + scale * (counts - reference), scale signed. The conversion of counts to SI
 * and back is exact as long as |offset| is below 2^20 times the travel of 2^31 counts. */
class AxisUnits {
 public:
  AxisUnits() = default;
  /// @throw std::invalid_argument if a number is NaN or infinite, or not positive where it has to be.
  explicit AxisUnits(const Gearing& gearing);

  double toJoint(std::int32_t counts) const noexcept {
    return offset_ + scale_ * (static_cast<double>(counts) - static_cast<double>(reference_));
  }
  Counts toCounts(double joint) const noexcept;
  /// Converts a speed in counts/s to m/s or rad/s.
  double toJointSpeed(double counts_per_second) const noexcept { return scale_ * counts_per_second; }
  /// Signed speed in counts/s.
  double toCountSpeed(double speed) const noexcept { return speed / scale_; }
  /// A distance, speed or acceleration without sign, in counts, rounded, at most 2^32 - 1.
  std::uint32_t toCountMagnitude(double amount) const noexcept;

  /// Assigns this joint position to these counts, for drives whose counter starts at an arbitrary value. False if the
  /// position is not finite.
  bool setReference(std::int32_t counts, double joint) noexcept;

  /// m or rad per count, signed.
  double scale() const noexcept { return scale_; }
  /// Smallest step, m or rad.
  double resolution() const noexcept { return scale_ < 0.0 ? -scale_ : scale_; }
  bool reversed() const noexcept { return scale_ < 0.0; }

 private:
  double scale_ = 1.0;
  double offset_ = 0.0;
  std::int32_t reference_ = 0;
};

}  // namespace tandem::hal
