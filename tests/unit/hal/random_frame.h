// SPDX-License-Identifier: Apache-2.0
/** @file Random CAN frames of all kinds. */
#pragma once

#include "hal/can/frame.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::test {

/// Any frame that a classical bus (`fd`: a CAN FD bus) can carry, error frames included.
inline hal::can::CanFrame randomFrame(Random& random, bool fd = false) {
  hal::can::CanFrame frame;
  const double kind = random.uniform(0.0, 1.0);
  frame.extended = kind < 0.15;
  frame.error = kind > 0.97;
  frame.fd = fd && !frame.error && random.chance(0.4);
  frame.remote = !frame.fd && !frame.error && random.chance(0.1);
  frame.id = static_cast<std::uint32_t>(random.integer(0, frame.extended || frame.error ? 0x1FFFFFFF : 0x7FF));
  if (frame.fd) {
    frame.bit_rate_switch = random.chance(0.5);
    frame.error_state = random.chance(0.5);
    frame.length = hal::can::fdLengthFor(static_cast<std::size_t>(random.integer(0, 64)));
  } else {
    frame.length = static_cast<std::uint8_t>(random.integer(0, 8));
  }
  for (std::size_t k = 0; k < frame.length && !frame.remote; ++k)
    frame.data[k] = static_cast<std::uint8_t>(random.integer(0, 255));
  return frame;
}

}  // namespace tandem::test
