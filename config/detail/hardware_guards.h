// SPDX-License-Identifier: Apache-2.0
/** @file Keys of hardware files for power, torque and the emergency stop. */
#pragma once

#include "config/detail/loaders.h"
#include "hal/hardware.h"

namespace tandem::config {

/// The bus that a mapping names. @throw Error where it is none of these.
int busOf(const Map& map, const std::vector<hal::BusConfig>& buses);
/// `torque_limit` of a drive; not watched without it.
hal::TorqueLimit readTorqueLimit(const Map& drive);
/// `emergency_stop`, after buses and axes. @throw Error where an entry names no bit, or no drive of this file.
void readEmergencyStop(const Map& map, hal::HardwareConfig& hardware);

}  // namespace tandem::config
