// SPDX-License-Identifier: Apache-2.0
/** @file Conversion between encoder counts and joint positions (m, rad). */
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace tandem::hal {

/** Gearing of one axis. Counts are those of object 0x6064 or 0x6004. */
struct Gearing {
  double counts_per_revolution = 0.0;  ///< of the motor or encoder shaft
  double gear_ratio = 1.0;             ///< shaft revolutions per revolution of the output (lead screw or tube)
  double travel_per_revolution = 0.0;  ///< of the output: lead, m, for a translation; 2 pi rad for a rotation
  bool reversed = false;               ///< positive counts move the joint in its negative direction
  double offset = 0.0;                 ///< joint position at zero counts, m or rad
};

/** Unit in which a drive takes velocities and accelerations, of its motor's shaft. */
enum class RateUnit : std::uint8_t {
  kCounts = 0,            ///< counts/s, counts/s^2
  kRevolutionsPerMinute,  ///< rpm, rpm/s
  kRevolutionsPerSecond,  ///< 1/s, 1/s^2
};
inline constexpr std::array kRateUnits{RateUnit::kCounts, RateUnit::kRevolutionsPerMinute,
                                       RateUnit::kRevolutionsPerSecond};

/// Words of a hardware file for them, for velocities and for accelerations.
inline constexpr std::array kVelocityUnits{"counts_per_s", "rpm", "rev_per_s"};
inline constexpr std::array kAccelerationUnits{"counts_per_s2", "rpm_per_s", "rev_per_s2"};

/** Units of the objects with velocities (60FF, 6081, 6099, ...) and accelerations (6083 to 6085, 609A, ...). */
struct DriveUnits {
  RateUnit velocity = RateUnit::kCounts;
  RateUnit acceleration = RateUnit::kCounts;
  double velocity_scale = 1.0;  ///< numbers in the object per one of the unit: 1000 if it counts in thousandths
  double acceleration_scale = 1.0;
};

/** Number of CiA 303-2 with which a drive states these units in 60A9 (velocity) and 60AA (acceleration): power of ten,
 * numerator, denominator. Accelerations in rpm per second have the number that drives of maxon give them. */
std::uint32_t velocityCode(RateUnit unit, double scale);
std::uint32_t accelerationCode(RateUnit unit, double scale);
/// Units that such a number states, and the scale; nothing for another one.
std::optional<std::pair<RateUnit, double>> unitOfVelocityCode(std::uint32_t code);
std::optional<std::pair<RateUnit, double>> unitOfAccelerationCode(std::uint32_t code);
inline constexpr int kSmallestUnitPower = -6;  ///< of ten, in such a number

/** Factors of CiA 402-2 as a drive states them: numerator and divisor; 0: absent. */
struct StatedFactors {
  struct Ratio {
    std::uint32_t numerator = 0, divisor = 0;
    /// Neither absent nor 1:1, which drives have that leave the factor to others.
    bool isSet() const noexcept { return numerator != 0 && divisor != 0 && numerator != divisor; }
    double value() const noexcept { return static_cast<double>(numerator) / divisor; }
  };
  Ratio encoder;       ///< 608F: increments per revolutions of the motor
  Ratio gear;          ///< 6091: revolutions of the motor per revolutions of the driving shaft
  Ratio feed;          ///< 6092: position units per revolutions of the driving shaft
  Ratio velocity;      ///< 6096: number in 60FF per position unit/s
  Ratio acceleration;  ///< 6097: number in 6083 to 6085 per position unit/s^2
};
/// Counts of 6064 per revolution of the motor: feed / gear, else the encoder's; nothing if neither is set.
std::optional<double> statedCounts(const StatedFactors& factors);
/// Those counts where the gearing of the hardware file has others.
std::optional<double> differingCounts(const StatedFactors& factors, const Gearing& gearing);
/// "2000 counts per revolution of its motor (608F, 6091, 6092), the hardware file says 4096".
std::string describeCounts(double stated, const Gearing& gearing);
/// A factor that a drive states is not this one; their numbers are rounded.
bool factorDiffers(double stated, double expected) noexcept;

/** A position in counts that a 32-bit object can hold, or the nearest one. */
struct Counts {
  std::int32_t value = 0;
  bool exact = true;  ///< false: the position is not finite (value 0) or beyond 32 bits (value at the limit)
};

/** Range of counts. */
struct CountRange {
  std::int32_t least;
  std::int32_t most;
};

/** Conversion of one axis: joint = offset + scale * (counts - reference), scale signed. The conversion of counts to SI
 * and back is exact as long as |offset| is below 2^20 times the travel of 2^31 counts. */
class AxisUnits {
 public:
  AxisUnits() = default;
  /// @throw std::invalid_argument if a number is NaN or infinite, or not positive where it has to be.
  explicit AxisUnits(const Gearing& gearing, const DriveUnits& drive = {});

  double toJoint(std::int32_t counts) const noexcept {
    return offset_ + scale_ * (static_cast<double>(counts) - static_cast<double>(reference_));
  }
  Counts toCounts(double joint) const noexcept;
  /// Software limits of the drive for those of a joint: one count wider, so that the joint's own limits, rounded, are
  /// allowed. None if 32 bits cannot hold one.
  std::optional<CountRange> softwareLimits(double lower, double upper) const noexcept;
  /// Converts a speed in counts/s to m/s or rad/s.
  double toJointSpeed(double counts_per_second) const noexcept { return scale_ * counts_per_second; }
  /// Signed speed in counts/s.
  double toCountSpeed(double speed) const noexcept { return speed / scale_; }
  /// A distance without sign, in counts, rounded, at most 2^32 - 1.
  std::uint32_t toCountMagnitude(double distance) const noexcept;
  /// Number of the drive's object for a velocity or acceleration (m or rad per s, per s^2), with its sign, rounded, of
  /// 32 bits at most.
  std::int64_t toVelocityNumber(double velocity) const noexcept { return rounded(velocity / scale_ * velocity_); }
  std::int64_t toAccelerationNumber(double acceleration) const noexcept {
    return rounded(acceleration / scale_ * acceleration_);
  }
  /// Counts/s (counts/s^2) in one of these numbers.
  double countsPerVelocityNumber() const noexcept { return 1.0 / velocity_; }
  double countsPerAccelerationNumber() const noexcept { return 1.0 / acceleration_; }

  /// Assigns this joint position to these counts, for drives whose counter starts at an arbitrary value. False if the
  /// position is not finite.
  bool setReference(std::int32_t counts, double joint) noexcept;

  /// m or rad per count, signed.
  double scale() const noexcept { return scale_; }
  /// Smallest step, m or rad.
  double resolution() const noexcept { return scale_ < 0.0 ? -scale_ : scale_; }
  bool reversed() const noexcept { return scale_ < 0.0; }

 private:
  static std::int64_t rounded(double number) noexcept;

  double scale_ = 1.0;
  double velocity_ = 1.0;  ///< numbers in the drive's object per count/s
  double acceleration_ = 1.0;
  double offset_ = 0.0;
  std::int32_t reference_ = 0;
};

}  // namespace tandem::hal
