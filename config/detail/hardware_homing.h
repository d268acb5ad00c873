// SPDX-License-Identifier: Apache-2.0
/** @file Checks of homing runs in hardware files. */
#pragma once

#include "config/detail/loaders.h"
#include "config/drive_profile.h"
#include "hal/hardware.h"

namespace tandem::config {

/** Reads `hard_stop` of a drive whose other keys have been read, and checks it, `homing` and `jump_tolerance`.
 * @param methods  those of the manufacturer that the profile of the drive names
 * @throw Error for a run without its `reference` and the reverse, a reserved method, one of the manufacturer that is
 * not in `methods`, a speed above that of the axis. */
void readReference(const Map& drive, const std::vector<VendorHoming>& methods, hal::AxisConfig& axis);

/** Checks that the carriages of every arm keep equation (1) while they home together: they move at one speed and end
 * inside it, and none turns around; every distance then changes monotonically between two values that satisfy it.
 * @throw Error */
void checkHomingTogether(const Map& map, const hal::HardwareConfig& hardware);

}  // namespace tandem::config
