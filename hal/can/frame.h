// SPDX-License-Identifier: Apache-2.0
/** @file CAN frame, independent of the transport. */
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace tandem::hal::can {

/// Largest payload of a classical frame and of a CAN FD frame, bytes.
inline constexpr std::size_t kClassicLength = 8;
inline constexpr std::size_t kFdLength = 64;

/** A data, remote or error frame. */
struct CanFrame {
  std::uint32_t id = 0;          ///< 11 bits, 29 if `extended`; of an error frame: its class bits (linux/can/error.h)
  bool extended = false;         ///< 29-bit identifier
  bool remote = false;           ///< asks for data; `length` is the length asked for
  bool error = false;            ///< made by the controller, never on the wire
  bool fd = false;               ///< CAN FD format
  bool bit_rate_switch = false;  ///< CAN FD: payload at the data bit rate
  bool error_state = false;      ///< CAN FD: the sender is error passive
  std::uint8_t length = 0;       ///< bytes of `data` that count
  std::array<std::uint8_t, kFdLength> data{};
  std::int64_t time = 0;  ///< of reception, ns on CLOCK_MONOTONIC; 0 in frames to send

  std::span<const std::uint8_t> payload() const noexcept { return {data.data(), remote ? 0u : length}; }
  /// A data frame with an 11-bit identifier and at most 8 bytes: all that CANopen uses.
  bool classicData() const noexcept { return !extended && !remote && !error && !fd; }
};

/// A classical data frame with an 11-bit identifier; bytes beyond 8 are left out.
CanFrame makeFrame(std::uint32_t id, std::span<const std::uint8_t> payload) noexcept;

/// Equal on the wire: everything but the time, and only the bytes that count.
bool sameOnWire(const CanFrame& a, const CanFrame& b) noexcept;

/// Smallest length that CAN FD can carry for so many bytes: 0..8, 12, 16, 20, 24, 32, 48, 64.
std::uint8_t fdLengthFor(std::size_t bytes) noexcept;

/// Whether a frame of this kind can have this length.
bool lengthIsValid(const CanFrame& frame) noexcept;

}  // namespace tandem::hal::can
