// SPDX-License-Identifier: Apache-2.0
#include "hal/can/detail/kernel_frame.h"

#include <linux/can/error.h>

#include <cstring>

namespace tandem::hal::can {

std::size_t encodeFrame(const CanFrame& frame, canfd_frame& out) noexcept {
  out.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0u) | (frame.remote ? CAN_RTR_FLAG : 0u) |
               (frame.error ? CAN_ERR_FLAG : 0u);
  out.len = frame.length;
  out.flags = 0;
  if (frame.fd) {
    out.flags =
        static_cast<std::uint8_t>((frame.bit_rate_switch ? CANFD_BRS : 0) | (frame.error_state ? CANFD_ESI : 0));
  }
  std::memcpy(out.data, frame.data.data(), frame.length);
  return frame.fd ? CANFD_MTU : CAN_MTU;
}

bool decodeFrame(const canfd_frame& in, std::size_t length, CanFrame& frame) noexcept {
  if (length != CAN_MTU && length != CANFD_MTU)
    return false;
  frame.fd = length == CANFD_MTU;
  frame.error = (in.can_id & CAN_ERR_FLAG) != 0;
  frame.extended = !frame.error && (in.can_id & CAN_EFF_FLAG) != 0;
  frame.remote = !frame.error && (in.can_id & CAN_RTR_FLAG) != 0;
  frame.id = in.can_id & (frame.error ? CAN_ERR_MASK : frame.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame.bit_rate_switch = frame.fd && (in.flags & CANFD_BRS) != 0;
  frame.error_state = frame.fd && (in.flags & CANFD_ESI) != 0;
  frame.length = in.len;
  if (!lengthIsValid(frame))
    return false;
  std::memcpy(frame.data.data(), in.data, frame.length);
  return true;
}

}  // namespace tandem::hal::can
