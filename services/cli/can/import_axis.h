// SPDX-License-Identifier: Apache-2.0
/** @file What follows from a data sheet for the axis that tandem can import makes. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "config/axis_block.h"
#include "hal/canopen/eds.h"
#include "hal/cia402/sheet_check.h"
#include "hal/hardware.h"

namespace tandem::cli {

/// "0x6040".
std::string hexadecimal(std::uint64_t value);

/** Sets units, objects per PDO and the watch of an axis as its sheet says. @param notes  what a person should know of
 * it.
 * @return keys of units that neither the sheet nor the hardware file nor its profile states: nobody may guess them */
std::vector<std::string> takeFromSheet(const hal::canopen::Eds& sheet,
                                       const config::AxisOrigin& origin,
                                       hal::AxisConfig& drive,
                                       std::vector<std::string>& notes);

/// Compares the maker and the product of a sheet with those of a profile; a difference becomes a warning of the sheet.
void judgeMaker(const config::DriveProfile& profile, hal::canopen::Eds& sheet);

/// Notes that a drive with the default values of its sheet would be refused for its counts per revolution.
void judgeCounts(const hal::AxisConfig& drive, const hal::SheetCheck& check, std::vector<std::string>& notes);

/// Compares what the profile of the axis says that its drive lacks with what its sheet lacks, in the mode of the axis.
void judgeProfile(const hal::AxisConfig& drive, hal::ProtectionMask lost, std::vector<std::string>& notes);

}  // namespace tandem::cli
