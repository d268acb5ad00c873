// SPDX-License-Identifier: Apache-2.0
/** @file Linux frame layouts (struct can_frame, struct canfd_frame). */
#pragma once

#include <linux/can.h>

#include "hal/can/frame.h"

namespace tandem::hal::can {

/// @return valid bytes of `out`: CAN_MTU or CANFD_MTU.
std::size_t encodeFrame(const CanFrame& frame, canfd_frame& out) noexcept;

/// Does not set the time. @return false: no frame of that length, or no such frame.
bool decodeFrame(const canfd_frame& in, std::size_t length, CanFrame& frame) noexcept;

}  // namespace tandem::hal::can
