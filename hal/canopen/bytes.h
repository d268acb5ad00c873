// SPDX-License-Identifier: Apache-2.0
/** @file CANopen numbers: little endian. */
#pragma once

#include <cstdint>
#include <span>

namespace tandem::hal::canopen {

/// Unsigned number from up to 8 bytes.
constexpr std::uint64_t fromBytes(std::span<const std::uint8_t> bytes) noexcept {
  std::uint64_t value = 0;
  for (std::size_t k = 0; k < bytes.size() && k < 8; ++k)
    value |= std::uint64_t{bytes[k]} << (8 * k);
  return value;
}

/// Writes the low bytes of a number into all of `bytes` (up to 8; the rest becomes 0).
constexpr void toBytes(std::uint64_t value, std::span<std::uint8_t> bytes) noexcept {
  for (std::size_t k = 0; k < bytes.size(); ++k)
    bytes[k] = k < 8 ? static_cast<std::uint8_t>(value >> (8 * k)) : 0;
}

/// The low `bits` (1..64) of a number, read as two's complement.
constexpr std::int64_t signExtend(std::uint64_t value, int bits) noexcept {
  const int unused = 64 - bits;
  return static_cast<std::int64_t>(value << unused) >> unused;
}

/// The low `bits` (1..64) of a number.
constexpr std::uint64_t lowBits(std::uint64_t value, int bits) noexcept {
  return bits >= 64 ? value : value & ((std::uint64_t{1} << bits) - 1);
}

/** The number of an object of `bits` bits (0: any) that was sent in `sent` bits: more bits than it has may only extend
 * it by zeros or by its sign. @param[out] fits  false: they are part of a larger number; all of it is returned. */
constexpr std::uint64_t withoutExtension(std::uint64_t all, int sent, int bits, bool& fits) noexcept {
  fits = true;
  if (bits == 0 || sent <= bits)
    return all;
  const std::uint64_t number = lowBits(all, bits);
  fits = all == number || all == lowBits(static_cast<std::uint64_t>(signExtend(number, bits)), sent);
  return fits ? number : all;
}

}  // namespace tandem::hal::canopen
