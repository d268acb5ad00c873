// SPDX-License-Identifier: Apache-2.0
/** @file Exclusive claim on the buses before the first frame is sent. */
#pragma once

#include <vector>

#include "hal/can/bus_lock.h"
#include "services/hal/hal_core.h"

namespace tandem::hal_service {

/** Takes one lock per CAN bus, against a second HAL on this host; a library claims its hardware by itself.
 * @throw ResourceInUse that names the bus and the process that has its lock. */
std::vector<hal::can::BusLock> lockBuses(const hal::HardwareConfig& hardware);

/** Listens on all buses for RobotHardware::listeningTime(), to detect a second HAL on another host, or any other
 * master.
 * @return false if a stop was requested. @throw ResourceInUse that names the bus, the received frames, and the remedy.
 */
bool waitForSilentBus(HalCore& core, const runtime::StopSignal& stop);

}  // namespace tandem::hal_service
