// SPDX-License-Identifier: Apache-2.0
/** @file What follows from a data sheet for the axis that tandem can import makes. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hal/canopen/eds.h"
#include "hal/hardware.h"

namespace tandem::cli {

/// "0x6040".
std::string hexadecimal(std::uint64_t value);

/// Sets units, objects per PDO and the watch of an axis as its sheet says. @param notes  what a person should know of
/// it
void takeFromSheet(const hal::canopen::Eds& sheet, hal::AxisConfig& drive, std::vector<std::string>& notes);

/// Compares what the profile of the axis says that its drive lacks with what its sheet lacks, in the mode of the axis.
void judgeProfile(const hal::AxisConfig& drive, hal::ProtectionMask lost, std::vector<std::string>& notes);

}  // namespace tandem::cli
