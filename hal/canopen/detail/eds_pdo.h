// SPDX-License-Identifier: Apache-2.0
/** @file PDO parameters that a data sheet states in short: CompactPDO of [DeviceInfo] (CiA 306-1). */
#pragma once

#include <cstdint>
#include <vector>

#include "hal/canopen/eds.h"

namespace tandem::hal::canopen {

/// Communication or mapping parameter of a PDO: 1400 to 17FF, 1800 to 1BFF.
bool isPdoParameter(std::uint16_t index);
bool isPdoMapping(std::uint16_t index);

/** What CiA 301 says of such a record: types, access, predefined COB-ids.
 * @param mask  of a communication parameter: bit k means that it has sub-index k + 1 (CompactPDO)
 * @param entries  of a mapping parameter: its number of sub-indices after the first */
std::vector<EdsObject> pdoParameter(std::uint16_t index, std::uint32_t mask, int entries, std::size_t line);

}  // namespace tandem::hal::canopen
