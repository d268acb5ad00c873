// SPDX-License-Identifier: Apache-2.0
/** @file PDO mapping: objects in up to eight bytes, and its configuration over SDO. */
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hal/can/frame.h"
#include "hal/canopen/bytes.h"
#include "hal/canopen/setup.h"

namespace tandem::hal::canopen {

using can::CanFrame;

/** One object in a PDO. */
struct PdoEntry {
  ObjectAddress object;
  int bits = 0;
  /// Encoding in objects 1600 and 1A00: index << 16 | sub << 8 | bits.
  constexpr std::uint32_t raw() const noexcept {
    return std::uint32_t{object.index} << 16 | std::uint32_t{object.sub} << 8 | static_cast<std::uint32_t>(bits);
  }
  static constexpr PdoEntry fromRaw(std::uint32_t raw) noexcept {
    return {{static_cast<std::uint16_t>(raw >> 16), static_cast<std::uint8_t>(raw >> 8)}, static_cast<int>(raw & 0xFF)};
  }
};

/** The objects of one PDO, in order, up to 64 bits. A slot is a position in this order. Values travel as one 64-bit
 * word, the PDO's bytes in little endian. */
class PdoLayout {
 public:
  static constexpr int kMaxEntries = 8;

  /// Adds an entry. @return its slot; -1: no space left, or not 1 to 64 bits.
  int add(const PdoEntry& entry) noexcept;
  void clear() noexcept { *this = {}; }

  int size() const noexcept { return size_; }
  int bits() const noexcept { return bits_; }
  /// Length of the frame.
  int bytes() const noexcept { return (bits_ + 7) / 8; }
  const PdoEntry& operator[](int slot) const noexcept { return entries_[slot]; }

  std::uint64_t get(std::uint64_t word, int slot) const noexcept {
    return lowBits(word >> offset_[slot], entries_[slot].bits);
  }
  std::int64_t getSigned(std::uint64_t word, int slot) const noexcept {
    return signExtend(word >> offset_[slot], entries_[slot].bits);
  }
  /// The word with a new value in this slot; the value's excess high bits are cut off.
  std::uint64_t with(std::uint64_t word, int slot, std::uint64_t value) const noexcept {
    const std::uint64_t mask = lowBits(~std::uint64_t{0}, entries_[slot].bits) << offset_[slot];
    return (word & ~mask) | ((value << offset_[slot]) & mask);
  }

 private:
  std::array<PdoEntry, kMaxEntries> entries_{};
  std::array<std::uint8_t, kMaxEntries> offset_{};
  int size_ = 0;
  int bits_ = 0;
};

enum class PdoDirection : std::uint8_t {
  kReceive,   ///< RPDO: the node receives
  kTransmit,  ///< TPDO: the node sends
};

/** Configuration of one PDO. */
struct PdoConfig {
  int number = 1;                      ///< 1..512; up to 4 have a predefined COB-ID
  std::uint32_t id = 0;                ///< 11-bit COB-ID; 0: the predefined one
  std::uint8_t transmission_type = 1;  ///< 0 at SYNC after a change, 1..240 every n-th SYNC, 254/255 by event
  std::uint16_t inhibit_time = 0;      ///< 100 us; TPDOs
  std::uint16_t event_timer = 0;       ///< ms; of an RPDO: the deadline that the node watches
  std::uint32_t protections = 0;       ///< lost if the node has no event timer (SetupStep); 0: then its boot fails
  PdoLayout layout;
};

/// COB-ID of a PDO of this node. @throw std::invalid_argument if there is none, or 0.
std::uint32_t cobIdOf(const PdoConfig& pdo, PdoDirection direction, int node);

/** Steps that configure one PDO in the order of CiA 301: invalid, no entries, entries, count, type and timers, valid;
 * then all of it is read back. @throw std::invalid_argument for a number out of range or a layout without entries. */
std::vector<SetupStep> pdoSteps(const PdoConfig& pdo, PdoDirection direction, int node);
/// Steps that disable a PDO.
std::vector<SetupStep> pdoOffSteps(int number, PdoDirection direction, int node);

}  // namespace tandem::hal::canopen
