// SPDX-License-Identifier: Apache-2.0
/** @file What a hardware file says of power, torque and the emergency stop. */
#pragma once

#include "config/loaders.h"
#include "hal/hardware.h"

namespace tandem::config {

/// `holds_without_power` of a drive.
hal::PowerlessHold readPowerlessHold(const Map& drive);
/// `torque_limit` of a drive; not watched without it.
hal::TorqueLimit readTorqueLimit(const Map& drive);
/// `emergency_stop`, after buses and axes. @throw Error where an entry names no bit, or no drive of this file.
void readEmergencyStop(const Map& map, hal::HardwareConfig& hardware);

}  // namespace tandem::config
