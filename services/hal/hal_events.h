// SPDX-License-Identifier: Apache-2.0
/** @file Log messages for hardware events. */
#pragma once

#include <string>

#include "hal/robot_hardware.h"

namespace tandem::hal_service {

/// "bus bus_a (can:can0)".
std::string nameOf(const hal::BusConfig& bus);

/** An event for people and logs. Not for the periodic thread: it allocates. Reads nothing of the robot that changes
 * after its construction. */
std::string describe(const hal::HardwareEvent& event, const hal::RobotHardware& robot);

/// Something that somebody has to look at.
bool isProblem(const hal::HardwareEvent& event);

}  // namespace tandem::hal_service
