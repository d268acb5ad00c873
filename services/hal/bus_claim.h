// SPDX-License-Identifier: Apache-2.0
/** @file Exclusive claim on the buses before the first frame is sent. */
#pragma once

#include <vector>

#include "hal/can/bus_lock.h"
#include "services/hal/hal_core.h"

namespace tandem::hal_service {

/** One lock per bus, against a second HAL on this host.
 * @throw ResourceInUse naming the bus and who has it. */
std::vector<hal::can::BusLock> lockBuses(const hal::HardwareConfig& hardware);

/** Listens on all buses for HalCore::listeningTime(), against a second HAL elsewhere, and any other master.
 * @return false where a stop was requested. @throw ResourceInUse naming the bus, what was received, and what to do. */
bool waitForSilentBus(HalCore& core, const runtime::StopSignal& stop);

}  // namespace tandem::hal_service
