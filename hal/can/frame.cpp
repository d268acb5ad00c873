// SPDX-License-Identifier: Apache-2.0
#include "hal/can/frame.h"

#include <algorithm>

namespace tandem::hal::can {
namespace {

constexpr std::array<std::uint8_t, 8> kFdLengths{8, 12, 16, 20, 24, 32, 48, 64};

}  // namespace

CanFrame makeFrame(std::uint32_t id, std::span<const std::uint8_t> payload) noexcept {
  CanFrame frame;
  frame.id = id & 0x7FF;
  frame.length = static_cast<std::uint8_t>(std::min(payload.size(), kClassicLength));
  std::copy_n(payload.begin(), frame.length, frame.data.begin());
  return frame;
}

bool sameOnWire(const CanFrame& a, const CanFrame& b) noexcept {
  return a.id == b.id && a.extended == b.extended && a.remote == b.remote && a.error == b.error && a.fd == b.fd &&
         a.bit_rate_switch == b.bit_rate_switch && a.error_state == b.error_state && a.length == b.length &&
         std::ranges::equal(a.payload(), b.payload());
}

std::uint8_t fdLengthFor(std::size_t bytes) noexcept {
  if (bytes <= kClassicLength)
    return static_cast<std::uint8_t>(bytes);
  const auto* length = std::ranges::lower_bound(kFdLengths, std::min(bytes, kFdLength));
  return *length;
}

bool lengthIsValid(const CanFrame& frame) noexcept {
  if (!frame.fd)
    return frame.length <= kClassicLength;
  return !frame.remote && frame.length <= kFdLength && fdLengthFor(frame.length) == frame.length;
}

}  // namespace tandem::hal::can
