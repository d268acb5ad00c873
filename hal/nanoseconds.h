// SPDX-License-Identifier: Apache-2.0
/** @file Conversion of durations to nanoseconds. */
#pragma once

#include <cstdint>

namespace tandem::hal {

inline constexpr std::int64_t kSecond = 1'000'000'000;  ///< ns

/// @param seconds a duration, s @return the same, ns
inline std::int64_t nanoseconds(double seconds) noexcept { return static_cast<std::int64_t>(1e9 * seconds); }

}  // namespace tandem::hal
