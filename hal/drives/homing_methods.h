// SPDX-License-Identifier: Apache-2.0
/** @file Homing methods of CiA 402-2 (object 0x6098), as far as the HAL must know them. */
#pragma once

namespace tandem::hal {

/// Method numbers that CiA 402-2 does not define and no manufacturer may use.
constexpr bool isReservedHomingMethod(int method) noexcept {
  const bool defined = (method >= 1 && method <= 14) || (method >= 17 && method <= 30) || method == 33 ||
                       method == 34 || method == 35 || method == 37;
  return method >= 0 && !defined;
}

/// The axis searches its home switch on both sides: it turns around at a limit switch (7 to 14, 23 to 30).
constexpr bool homingTurnsAround(int method) noexcept {
  return (method >= 7 && method <= 14) || (method >= 23 && method <= 30);
}

/// The present position is the reference: the axis does not move.
constexpr bool homesWithoutMotion(int method) noexcept { return method == 35 || method == 37; }

/// Only the index pulse is searched, at the slow speed.
constexpr bool homesToIndexAlone(int method) noexcept { return method == 33 || method == 34; }

}  // namespace tandem::hal
