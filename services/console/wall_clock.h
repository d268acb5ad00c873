// SPDX-License-Identifier: Apache-2.0
/** @file The time that clients are told. */
#pragma once

#include <chrono>
#include <cstdint>

namespace tandem::console {

/// @return ns since 1970
inline std::int64_t wallClock() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

}  // namespace tandem::console
