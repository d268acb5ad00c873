// SPDX-License-Identifier: Apache-2.0
/** @file Clock of CAN frame time stamps: monotonic, shifted from the realtime stamps of the kernel. */
#pragma once

#include <cstdint>

namespace tandem::hal::can {

/// CLOCK_MONOTONIC, ns.
std::int64_t monotonicNow() noexcept;

/// CLOCK_REALTIME minus CLOCK_MONOTONIC now, ns; kernel time stamps are on the former.
std::int64_t realtimeOffset() noexcept;

/** A kernel time stamp converted to the monotonic clock, ns. If the wall clock was set between the stamp and now, the
 * difference is invalid: a stamp in the future, or more than a second old, becomes `now`. */
std::int64_t toMonotonic(std::int64_t realtime_stamp, std::int64_t now, std::int64_t offset) noexcept;

}  // namespace tandem::hal::can
