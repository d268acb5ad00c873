// SPDX-License-Identifier: Apache-2.0
/** @file Units that a key may have as its suffix, and their conversion to SI: the only such table in the project. */
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::config {

/** Physical quantity of a value. kNone: a plain number, whose key has no unit. */
enum class Quantity {
  kNone,
  kLength,
  kAngle,
  kSpeed,
  kAngularSpeed,
  kAcceleration,
  kAngularAcceleration,
  kCurvature,
  kModulus,
  kStiffness,
  kForce,
  kTime,
  kFrequency,
  kGain,
  kBitRate,
  kSpringStiffness,
};

/** One unit: SI value = value * numerator / denominator. Two exact factors, so that 0.88 mm becomes the double nearest
 * to 0.88e-3 as often as possible. */
struct Unit {
  std::string_view suffix;  ///< as in the key, without the underscore: "mm_per_s"
  Quantity quantity;
  double numerator;
  double denominator;

  double toSi(double value) const { return value * numerator / denominator; }
  double fromSi(double value) const { return value * denominator / numerator; }
  /// "mm/s2" of mm_per_s2, "1/mm" of per_mm.
  std::string forPeople() const;
};

/// All units; the preferred one of each quantity comes first.
std::span<const Unit> units();

/// Units of a quantity, preferred first; empty for kNone.
std::vector<const Unit*> unitsOf(Quantity quantity);

/// "a length", "an angular speed"; "a number" for kNone.
std::string_view name(Quantity quantity);

}  // namespace tandem::config
