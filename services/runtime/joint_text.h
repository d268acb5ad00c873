// SPDX-License-Identifier: Apache-2.0
/** @file Positions and distances of joints as texts for people. */
#pragma once

#include <fmt/format.h>

#include <numbers>
#include <string>

namespace tandem::runtime {

/// "12.500 mm" of a translation, "30.000 deg" of a rotation. @param value  m or rad @param number  its format
inline std::string jointText(double value, bool translation, fmt::format_string<double> number = "{:.3f}") {
  return fmt::format(number, value * (translation ? 1e3 : 180.0 / std::numbers::pi)) + (translation ? " mm" : " deg");
}

}  // namespace tandem::runtime
