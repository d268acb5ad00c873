// SPDX-License-Identifier: Apache-2.0
/** @file Electronic data sheets (CiA 306): object lists of CANopen devices. */
#pragma once

#include <cstdint>
#include <istream>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "hal/canopen/sdo.h"

namespace tandem::sim::drives {

using hal::canopen::ObjectAddress;

/** A data sheet that cannot be read. what(): "FILE:LINE: reason". */
class EdsError : public std::runtime_error {
 public:
  EdsError(const std::string& file, std::size_t line, const std::string& reason);
};

/** Data types of CiA 301 that a simulated device can have. */
enum class DataType : std::uint16_t {
  kBoolean = 0x01,
  kInteger8 = 0x02,
  kInteger16 = 0x03,
  kInteger32 = 0x04,
  kUnsigned8 = 0x05,
  kUnsigned16 = 0x06,
  kUnsigned32 = 0x07,
  kVisibleString = 0x09,
  kInteger64 = 0x15,
  kUnsigned64 = 0x1B,
};
/// Bytes of a number; 0: a string.
int sizeOf(DataType type);
bool isSigned(DataType type);

enum class Access : std::uint8_t { kReadOnly, kWriteOnly, kReadWrite, kConstant };

/** One entry of a data sheet. */
struct EdsObject {
  ObjectAddress address;
  std::string name;
  DataType type = DataType::kUnsigned32;
  Access access = Access::kReadOnly;
  bool mappable = false;            ///< allowed in a PDO
  std::optional<std::int64_t> low;  ///< limits, as numbers of the type
  std::optional<std::int64_t> high;
  std::int64_t value = 0;  ///< default
  bool adds_node_id = false;
  bool hidden = false;   ///< of the simulation alone: nobody can access it
  std::string text;      ///< default of a string
  std::size_t line = 0;  ///< line of its section
};

struct Eds {
  std::string file;
  std::string product;
  std::vector<EdsObject> objects;  ///< sorted by address
};

/** Reads a data sheet and checks its consistency: the lists and the objects agree, sub-index counts are correct,
 * defaults and limits fit their types. @throw EdsError. */
Eds parseEds(std::istream& in, const std::string& file);
/// @throw EdsError, std::runtime_error if the file cannot be opened.
Eds loadEds(const std::string& path);

/// `eds`, and the objects of `own` that it lacks, hidden: a simulated device needs them for itself.
Eds completed(Eds eds, const Eds& own);

/// Built-in data sheets, read once.
const Eds& driveEds();
const Eds& encoderEds();

}  // namespace tandem::sim::drives
