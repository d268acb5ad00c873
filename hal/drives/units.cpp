// SPDX-License-Identifier: Apache-2.0
#include "hal/drives/units.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <string>

namespace tandem::hal {

namespace {

/// Units per count/s or count/s^2.
double perCount(RateUnit unit, double counts_per_revolution) {
  constexpr double kSecondsPerMinute = 60.0;
  switch (unit) {
    case RateUnit::kRevolutionsPerMinute:
      return kSecondsPerMinute / counts_per_revolution;
    case RateUnit::kRevolutionsPerSecond:
      return 1.0 / counts_per_revolution;
    case RateUnit::kCounts:
      break;
  }
  return 1.0;
}

using Codes = std::array<std::uint32_t, kRateUnits.size()>;
constexpr Codes kVelocityCodes{0xB50300, 0xB44700, 0xB40300};
constexpr Codes kAccelerationCodes{0xB55700, 0xC00300, 0xB45700};

std::uint32_t codeOf(const Codes& codes, RateUnit unit, double scale) {
  const auto power = static_cast<std::int8_t>(-std::lround(std::log10(scale)));
  return std::uint32_t{static_cast<std::uint8_t>(power)} << 24 | codes[static_cast<std::size_t>(unit)];
}

std::optional<std::pair<RateUnit, double>> unitOf(const Codes& codes, std::uint32_t code) {
  for (const RateUnit unit : kRateUnits) {
    for (int power = kSmallestUnitPower; power <= 0; ++power) {
      const double scale = std::pow(10.0, -power);
      if (codeOf(codes, unit, scale) == code)
        return std::pair{unit, scale};
    }
  }
  return std::nullopt;
}

}  // namespace

std::uint32_t velocityCode(RateUnit unit, double scale) { return codeOf(kVelocityCodes, unit, scale); }
std::uint32_t accelerationCode(RateUnit unit, double scale) { return codeOf(kAccelerationCodes, unit, scale); }
std::optional<std::pair<RateUnit, double>> unitOfVelocityCode(std::uint32_t code) {
  return unitOf(kVelocityCodes, code);
}
std::optional<std::pair<RateUnit, double>> unitOfAccelerationCode(std::uint32_t code) {
  return unitOf(kAccelerationCodes, code);
}

AxisUnits::AxisUnits(const Gearing& gearing, const DriveUnits& drive) {
  const auto positive = [](double value, const char* what) {
    if (!(std::isfinite(value) && value > 0.0))
      throw std::invalid_argument(std::string("units of an axis: ") + what + ": found " + std::to_string(value) +
                                  ", expected a finite number above zero");
    return value;
  };
  const double counts =
      positive(gearing.counts_per_revolution, "counts_per_revolution") * positive(gearing.gear_ratio, "gear_ratio");
  const double magnitude = positive(gearing.travel_per_revolution, "travel_per_revolution") / counts;
  if (!std::isfinite(gearing.offset))
    throw std::invalid_argument("units of an axis: offset: found " + std::to_string(gearing.offset) +
                                ", expected a finite number");
  scale_ = positive(magnitude, "the travel per count") * (gearing.reversed ? -1.0 : 1.0);
  offset_ = gearing.offset;
  velocity_ =
      positive(drive.velocity_scale, "velocity_unit_scale") * perCount(drive.velocity, gearing.counts_per_revolution);
  acceleration_ = positive(drive.acceleration_scale, "acceleration_unit_scale") *
                  perCount(drive.acceleration, gearing.counts_per_revolution);
}

std::int64_t AxisUnits::rounded(double number) noexcept {
  constexpr double kMost = std::numeric_limits<std::uint32_t>::max();
  return std::llround(std::clamp(number, -kMost, kMost));
}

std::optional<double> statedCounts(const StatedFactors& factors) {
  if (factors.feed.isSet())
    return factors.feed.value() / (factors.gear.isSet() ? factors.gear.value() : 1.0);
  if (factors.encoder.isSet())
    return factors.encoder.value();
  return {};
}

std::optional<double> differingCounts(const StatedFactors& factors, const Gearing& gearing) {
  const auto counts = statedCounts(factors);
  return counts && factorDiffers(*counts, gearing.counts_per_revolution) ? counts : std::nullopt;
}

std::string describeCounts(double stated, const Gearing& gearing) {
  char text[160];  // 10 digits: encoders have more than a million counts
  std::snprintf(text, sizeof text,
                "%.10g counts per revolution of its motor (608F, 6091, 6092), the hardware file says %.10g", stated,
                gearing.counts_per_revolution);
  return text;
}

bool factorDiffers(double stated, double expected) noexcept {
  return std::abs(stated - expected) > 1e-3 * std::abs(expected);
}

Counts AxisUnits::toCounts(double joint) const noexcept {
  constexpr double kLowest = std::numeric_limits<std::int32_t>::min();
  constexpr double kHighest = std::numeric_limits<std::int32_t>::max();
  if (!std::isfinite(joint))
    return {0, false};
  const double counts = std::nearbyint((joint - offset_) / scale_ + static_cast<double>(reference_));
  if (counts < kLowest)
    return {std::numeric_limits<std::int32_t>::min(), false};
  if (counts > kHighest)
    return {std::numeric_limits<std::int32_t>::max(), false};
  return {static_cast<std::int32_t>(counts), true};
}

std::optional<CountRange> AxisUnits::softwareLimits(double lower, double upper) const noexcept {
  using Limits = std::numeric_limits<std::int32_t>;
  const Counts first = toCounts(lower), second = toCounts(upper);
  if (!first.exact || !second.exact)
    return std::nullopt;
  const std::int32_t least = std::min(first.value, second.value), most = std::max(first.value, second.value);
  return CountRange{least == Limits::min() ? least : least - 1, most == Limits::max() ? most : most + 1};
}

std::uint32_t AxisUnits::toCountMagnitude(double distance) const noexcept {
  constexpr double kHighest = std::numeric_limits<std::uint32_t>::max();
  const double counts = std::nearbyint(std::abs(distance / scale_));
  return counts < kHighest ? static_cast<std::uint32_t>(counts) : std::numeric_limits<std::uint32_t>::max();
}

bool AxisUnits::setReference(std::int32_t counts, double joint) noexcept {
  if (!std::isfinite(joint))
    return false;
  reference_ = counts;
  offset_ = joint;
  return true;
}

}  // namespace tandem::hal
