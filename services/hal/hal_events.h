// SPDX-License-Identifier: Apache-2.0
/** @file Log messages for hardware events. */
#pragma once

#include <string>

#include "hal/robot_hardware.h"

namespace tandem::hal_service {

/// "bus bus_a (can:can0)".
std::string nameOf(const hal::BusConfig& bus);

/** Description of an event for the log. Not for the periodic thread: it allocates. Reads only parts of the robot that
 * do not change after construction. */
std::string describe(const hal::HardwareEvent& event, const hal::RobotHardware& robot);

/// Whether an event needs the attention of an operator.
bool isProblem(const hal::HardwareEvent& event);

}  // namespace tandem::hal_service
