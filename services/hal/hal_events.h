// SPDX-License-Identifier: Apache-2.0
/** @file Log messages for hardware events. */
#pragma once

#include <string>

#include "hal/robot_hardware.h"
#include "services/dds/messages.h"

namespace tandem::hal_service {

/// "bus bus_a (can:can0)".
std::string nameOf(const hal::BusConfig& bus);

/** Description of an event for the log. Not for the periodic thread: it allocates. Reads only parts of the robot that
 * do not change after construction. */
std::string describe(const hal::HardwareEvent& event, const hal::RobotHardware& robot);

/// Protections that drives lack: "arm_a translation 1: command_deadline (1400:05); ..." or "none".
std::string describeLost(const hal::HardwareConfig& hardware, const dds::HalStatus& status);

/// Whether an event needs the attention of an operator.
bool isProblem(const hal::HardwareEvent& event);

}  // namespace tandem::hal_service
