// SPDX-License-Identifier: Apache-2.0
/** @file Selection of the drives and encoders to simulate. */
#pragma once

#include <functional>
#include <string>

#include "config/config.h"
#include "sim/drives/drive_bus.h"

namespace tandem::drive_sim {

/// "ID[,serial=N][,start=COUNTS][,low=COUNTS][,high=COUNTS][,max_velocity=N][,max_acceleration=N][,incremental]", and
/// the places of switches, in counts: negative_switch, positive_switch, home_from, home_to, index. @throw
/// std::invalid_argument with the found and the expected value.
sim::drives::DriveSpec parseDrive(const std::string& text);

/// "ID=DRIVE[,serial=N][,ratio=X][,offset=N]".
sim::drives::EncoderSpec parseEncoder(const std::string& text);

/** A data sheet for the drives of a bus: "FILE" for all, "NODE[,NODE...]=FILE" for some.
 * @param load reads the file
 * @throw std::invalid_argument for a node that is not 1 to 127. */
void addSheet(const std::string& text,
              const std::function<hal::canopen::Eds(const std::string&)>& load,
              sim::drives::BusSpec& spec);

/// Six drives, nodes 1 to 6, and six encoders, nodes 17 to 22, with serial numbers 1000 + id.
void addStandardNodes(sim::drives::BusSpec& spec);

/** Adds the nodes of one bus of a hardware file: same ids, serial numbers and gearing. Axes with absolute encoders
 * start where these read 0; axes that need homing start in the middle of their range, with switches and index pulse
 * where their homing run ends at `home_position`.
 * @throw std::invalid_argument if the file has no bus of that name. */
void addNodes(const hal::HardwareConfig& hardware, const std::string& bus, sim::drives::BusSpec& spec);

}  // namespace tandem::drive_sim
