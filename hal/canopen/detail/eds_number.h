// SPDX-License-Identifier: Apache-2.0
/** @file Numbers in data sheets (CiA 306): decimal, 0x..., octal 0..., with $NODEID. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/canopen/eds.h"

namespace tandem::hal::canopen {

/// The text without a comment behind it. @param[out] odd  gets a remark if there was one
std::string withoutComment(const std::string& text, std::vector<std::string>& odd);

/** The text of a value as a number. */
struct EdsNumber {
  std::uint64_t magnitude = 0;
  bool negative = false;
  bool adds_node_id = false;
  std::vector<std::string> odd;  ///< what is unusual about the text, and how it was read
};
/// nullopt: not a number.
std::optional<EdsNumber> readNumber(const std::string& text);

/** The number as a value of this type; nullopt: it does not fit. Negative numbers may be written as their two's
 * complement (0xFF for an INTEGER8), UNSIGNED64 has its bits. */
std::optional<std::int64_t> fit(const EdsNumber& number, DataType type);

/// Bits of a REAL32 or REAL64: "1.5", or hexadecimal bits. nullopt: neither.
std::optional<std::int64_t> readReal(const std::string& text, DataType type);

/// Largest number of an integer type of up to 7 bytes.
std::int64_t largest(DataType type);

}  // namespace tandem::hal::canopen
