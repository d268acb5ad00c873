// SPDX-License-Identifier: Apache-2.0
/** @file Object dictionary of a simulated device. */
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hal/canopen/bytes.h"
#include "sim/drives/eds.h"

namespace tandem::sim::drives {

using hal::canopen::SdoAbort;

/** One object. Numbers are kept as 64-bit two's complement. */
struct Entry {
  EdsObject info;
  std::int64_t value = 0;
  std::string text;
  bool hidden = false;  ///< internal to the simulation: clients cannot access it

  int size() const noexcept { return hal::canopen::sizeOf(info.type); }  ///< bytes; 0: a string
  int bits() const noexcept { return 8 * size(); }
  /// Number from the bits on the wire.
  std::int64_t decode(std::uint64_t raw) const noexcept;
  /// Bits on the wire: the low size() bytes.
  std::uint64_t raw() const noexcept { return static_cast<std::uint64_t>(value); }
};

/** Dictionary of a device. Its entries are fixed after construction: pointers to them stay valid. */
class ObjectDictionary {
 public:
  /** @param own  the built-in data sheet of this kind of device: objects that `eds` lacks are hidden ones of the
   * simulation, and those without a value start with the built-in one. Objects of the manufacturer (2000 to 5FFF) have
   * the built-in meaning only if `eds` describes the same product (1018:01, 1018:02). */
  ObjectDictionary(const Eds& eds, const Eds& own, std::uint8_t node);

  Entry* find(ObjectAddress address) noexcept;
  const Entry* find(ObjectAddress address) const noexcept;
  /// The same without hidden objects.
  const Entry* visible(ObjectAddress address) const noexcept;
  bool hasIndex(std::uint16_t index) const noexcept;  ///< a visible one
  /// An object of the manufacturer with its built-in meaning, also a hidden one; nullptr: it is another product.
  Entry* own(ObjectAddress address) noexcept { return own_product_ ? find(address) : nullptr; }
  /// Also a hidden object. @throw std::invalid_argument if there is none, or it is a string.
  Entry& require(std::uint16_t index, std::uint8_t sub = 0);
  /// Sets all objects with first <= index <= last to their defaults.
  void reset(std::uint16_t first, std::uint16_t last) noexcept;

  /// Reason why this object cannot be read; kNone: it can.
  SdoAbort checkRead(ObjectAddress address) const noexcept;
  /// The same for writing these bytes: existence, access, length, limits.
  SdoAbort checkWrite(ObjectAddress address, std::span<const std::uint8_t> bytes) const noexcept;

  /// What the device lacks of an object that is not visible: the sub-index or the whole object.
  SdoAbort missing(ObjectAddress address) const noexcept;

  std::vector<Entry>& entries() noexcept { return entries_; }

 private:
  std::vector<Entry> entries_;  // sorted by address
  std::uint8_t node_;
  bool own_product_ = false;
};

}  // namespace tandem::sim::drives
