// SPDX-License-Identifier: Apache-2.0
/** @file Electronic data sheets and device configuration files (EDS and DCF, CiA 306): the objects of a CANopen device,
 * as its vendor's file describes them. */
#pragma once

#include <cstdint>
#include <istream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/canopen/ini.h"
#include "hal/canopen/sdo.h"

namespace tandem::hal::canopen {

/** Data types of CiA 301. */
enum class DataType : std::uint16_t {
  kBoolean = 0x01,
  kInteger8 = 0x02,
  kInteger16 = 0x03,
  kInteger32 = 0x04,
  kUnsigned8 = 0x05,
  kUnsigned16 = 0x06,
  kUnsigned32 = 0x07,
  kReal32 = 0x08,
  kVisibleString = 0x09,
  kOctetString = 0x0A,
  kUnicodeString = 0x0B,
  kTimeOfDay = 0x0C,
  kTimeDifference = 0x0D,
  kDomain = 0x0F,  ///< bytes without a type; also a type that the file does not define
  kInteger24 = 0x10,
  kReal64 = 0x11,
  kInteger40 = 0x12,
  kInteger48 = 0x13,
  kInteger56 = 0x14,
  kInteger64 = 0x15,
  kUnsigned24 = 0x16,
  kUnsigned40 = 0x18,
  kUnsigned48 = 0x19,
  kUnsigned56 = 0x1A,
  kUnsigned64 = 0x1B,
};
/// "UNSIGNED32".
std::string_view name(DataType type);
/// Bytes of a number or a time; 0: a string or DOMAIN.
int sizeOf(DataType type);
bool isSigned(DataType type);
/// REAL32 or REAL64, whose values are kept as their bits.
bool isReal(DataType type);

enum class Access : std::uint8_t { kReadOnly, kWriteOnly, kReadWrite, kConstant };
/// "ro", "wo", "rw", "const".
std::string_view name(Access access);
constexpr bool readable(Access access) { return access != Access::kWriteOnly; }
constexpr bool writable(Access access) { return access == Access::kReadWrite || access == Access::kWriteOnly; }

/** One entry of a data sheet. */
struct EdsObject {
  ObjectAddress address;
  std::string name;
  DataType type = DataType::kUnsigned32;
  Access access = Access::kReadOnly;
  bool mappable = false;            ///< allowed in a PDO
  std::optional<std::int64_t> low;  ///< limits, as numbers of the type; none of a REAL
  std::optional<std::int64_t> high;
  /// Default, or the configured value of a DCF. UNSIGNED64: the same bits.
  std::int64_t value = 0;
  bool has_value = false;  ///< the file has it; otherwise `value` is 0, or the limit next to it
  bool adds_node_id = false;
  std::string text;      ///< default of a string
  std::size_t line = 0;  ///< line of its section

  /// Value at a node.
  std::int64_t valueAt(int node) const { return value + (adds_node_id ? node : 0); }
};

/** A data sheet. */
struct Eds {
  std::string file;
  std::string vendor_name;
  std::string product;                  ///< its name
  std::optional<std::uint32_t> vendor;  ///< numbers of [DeviceInfo]; in a node: object 1018
  std::optional<std::uint32_t> product_code;
  std::optional<std::uint32_t> revision;
  /// Lines of VendorName, ProductName and VendorNumber; 0: the file has none.
  std::size_t vendor_name_line = 0, product_line = 0, vendor_line = 0;
  std::optional<int> node;         ///< of a DCF
  std::vector<EdsObject> objects;  ///< sorted by address
  std::vector<FileWarning> warnings;

  const EdsObject* find(ObjectAddress address) const;
  bool hasIndex(std::uint16_t index) const;
};

/// "FILE:LINE: text" of a warning.
std::string describe(const Eds& eds, const FileWarning& warning);

/** Reads a data sheet. What is odd in it becomes a warning, with what was made of it.
 * @throw IniError for a file that is not an INI file, is too large, or describes no object. */
Eds parseEds(std::istream& in, const std::string& file);
/// @throw IniError, std::runtime_error if the file cannot be opened.
Eds loadEds(const std::string& path);

}  // namespace tandem::hal::canopen
