// SPDX-License-Identifier: Apache-2.0
/** @file Helpers shared by the commands of `tandem can` that use data sheets. */
#pragma once

#include <string>

#include "hal/canopen/eds.h"
#include "hal/cia402/sheet_check.h"
#include "hal/hardware.h"
#include "services/cli/can/can.h"

namespace tandem::cli {

/// Reads a data sheet; its warnings stay in it. @throw Failure(kUsage) if it cannot be read.
hal::canopen::Eds loadSheet(const std::string& path);
/// Prints at most `most` warnings to stderr, and how many more there are.
void printWarnings(const hal::canopen::Eds& sheet, std::size_t most);
/// Name of an object in a data sheet, empty: it is not there.
std::string nameIn(const hal::canopen::Eds& sheet, hal::canopen::ObjectAddress object);

/// Type of an object in a data sheet; in the absence of a sheet, or of the object in it, the one that CiA 301, 402 or
/// 406 gives it. Nothing: objects of manufacturers that no sheet describes.
std::optional<hal::canopen::DataType> typeIn(const hal::canopen::Eds& sheet, hal::canopen::ObjectAddress object);

/// "required", "optional", or the protections that need the step.
std::string needOf(const hal::canopen::SetupStep& step);

/** Reads the objects of the protections from a drive and prints which are absent. The access of an object and the range
 * of its values show only when the HAL writes them.
 * @return kOk, kFailure: the drive lacks one that a boot needs. */
int showProtections(const CanOptions& options, CanTool& tool, int node);

}  // namespace tandem::cli
