// SPDX-License-Identifier: Apache-2.0
#include "config/units.h"

#include <array>
#include <numbers>

namespace tandem::config {
namespace {

constexpr double kPi = std::numbers::pi;

constexpr std::array kUnits{
    Unit{"mm", Quantity::kLength, 1.0, 1e3},
    Unit{"m", Quantity::kLength, 1.0, 1.0},
    Unit{"deg", Quantity::kAngle, kPi, 180.0},
    Unit{"rad", Quantity::kAngle, 1.0, 1.0},
    Unit{"mm_per_s", Quantity::kSpeed, 1.0, 1e3},
    Unit{"m_per_s", Quantity::kSpeed, 1.0, 1.0},
    Unit{"rad_per_s", Quantity::kAngularSpeed, 1.0, 1.0},
    Unit{"deg_per_s", Quantity::kAngularSpeed, kPi, 180.0},
    Unit{"mm_per_s2", Quantity::kAcceleration, 1.0, 1e3},
    Unit{"m_per_s2", Quantity::kAcceleration, 1.0, 1.0},
    Unit{"rad_per_s2", Quantity::kAngularAcceleration, 1.0, 1.0},
    Unit{"deg_per_s2", Quantity::kAngularAcceleration, kPi, 180.0},
    Unit{"per_mm", Quantity::kCurvature, 1e3, 1.0},
    Unit{"per_m", Quantity::kCurvature, 1.0, 1.0},
    Unit{"GPa", Quantity::kModulus, 1e9, 1.0},
    Unit{"Pa", Quantity::kModulus, 1.0, 1.0},
    Unit{"Nm2", Quantity::kStiffness, 1.0, 1.0},
    Unit{"N", Quantity::kForce, 1.0, 1.0},
    Unit{"s", Quantity::kTime, 1.0, 1.0},
    Unit{"ms", Quantity::kTime, 1.0, 1e3},
    Unit{"Hz", Quantity::kFrequency, 1.0, 1.0},
    Unit{"per_s", Quantity::kGain, 1.0, 1.0},
    Unit{"kbit_per_s", Quantity::kBitRate, 1e3, 1.0},
    Unit{"bit_per_s", Quantity::kBitRate, 1.0, 1.0},
    Unit{"N_per_m", Quantity::kSpringStiffness, 1.0, 1.0},
};

}  // namespace

std::span<const Unit> units() { return kUnits; }

std::string Unit::forPeople() const {
  constexpr std::string_view kPer = "per_";
  const std::size_t per = suffix.find(kPer);
  if (per == std::string_view::npos)
    return std::string(suffix);
  const std::string below(suffix.substr(per + kPer.size()));
  return (per == 0 ? "1" : std::string(suffix.substr(0, per - 1))) + "/" + below;
}

std::vector<const Unit*> unitsOf(Quantity quantity) {
  std::vector<const Unit*> found;
  for (const Unit& unit : kUnits) {
    if (unit.quantity == quantity)
      found.push_back(&unit);
  }
  return found;
}

std::string_view name(Quantity quantity) {
  constexpr std::array<std::string_view, 16> kNames{
      "a number",
      "a length",
      "an angle",
      "a speed",
      "an angular speed",
      "an acceleration",
      "an angular acceleration",
      "a curvature",
      "a modulus",
      "a stiffness",
      "a force",
      "a time",
      "a frequency",
      "a gain",
      "a bit rate",
      "a spring stiffness",
  };
  return kNames[static_cast<std::size_t>(quantity)];
}

}  // namespace tandem::config
