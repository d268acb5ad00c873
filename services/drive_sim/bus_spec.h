// SPDX-License-Identifier: Apache-2.0
/** @file Selection of the drives and encoders to simulate. */
#pragma once

#include <string>

#include "config/config.h"
#include "sim/drives/drive_bus.h"

namespace tandem::drive_sim {

/// "ID[,serial=N][,start=COUNTS][,low=COUNTS][,high=COUNTS][,max_velocity=N][,max_acceleration=N][,incremental]".
/// @throw std::invalid_argument that says what was expected.
sim::drives::DriveSpec parseDrive(const std::string& text);

/// "ID=DRIVE[,serial=N][,ratio=X][,offset=N]".
sim::drives::EncoderSpec parseEncoder(const std::string& text);

/// Six drives, nodes 1 to 6, and six encoders, nodes 17 to 22, with serial numbers 1000 + id.
void addStandardNodes(sim::drives::BusSpec& spec);

/** The nodes of one bus of a hardware file: same ids, serial numbers and gearing. An arm whose axes have absolute
 * encoders stands where these read 0; one whose drives search their home stands in the middle of its range.
 * @throw std::invalid_argument where there is no bus of that name. */
void addNodes(const hal::HardwareConfig& hardware, const std::string& bus, sim::drives::BusSpec& spec);

}  // namespace tandem::drive_sim
