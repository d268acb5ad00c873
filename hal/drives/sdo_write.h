// SPDX-License-Identifier: Apache-2.0
/** @file SDO writes of a hardware file or drive profile: values that a drive gets at boot beside those of the HAL. */
#pragma once

#include <cstdint>
#include <string>

namespace tandem::hal {

/** One SDO write at boot, from `sdo` of a drive profile or hardware file. */
struct SdoWrite {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  int size = 4;            ///< bytes: 1, 2 or 4
  std::int64_t value = 0;  ///< negative for signed types
  bool read_back = true;
  std::uint64_t tolerance = 0;  ///< largest difference of the value that is read back: drives round
  bool optional = false;        ///< a drive without the object boots as well
  std::string why;              ///< what the value does, for messages
};

/** Why a hardware file may not write this object: it commands motion, or the HAL alone decides about it. Empty: it may.
 * In the communication area (1000 to 1FFF) only the SYNC objects 1006, 1007 and 1019 and the guarding objects 100C and
 * 100D may be written; of the profile area everything but what commands the drive. */
std::string forbidden(const SdoWrite& write);

}  // namespace tandem::hal
