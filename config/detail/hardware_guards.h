// SPDX-License-Identifier: Apache-2.0
/** @file Readers of `torque_limit` and `emergency_stop` in hardware files. */
#pragma once

#include "config/detail/loaders.h"
#include "hal/hardware.h"

namespace tandem::config {

/// Index of the bus that a mapping names. @throw Error if there is no such bus.
int busOf(const Map& map, const std::vector<hal::BusConfig>& buses);
/// Reads `torque_limit` of a drive; not watched if absent.
hal::TorqueLimit readTorqueLimit(const Map& drive);
/// Reads `emergency_stop`, after buses and axes. @throw Error for an entry without a bit, or without a drive of this
/// file.
void readEmergencyStop(const Map& map, hal::HardwareConfig& hardware);

}  // namespace tandem::config
