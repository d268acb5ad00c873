// SPDX-License-Identifier: Apache-2.0
/** @file Opening of the CAN buses of a hardware file. */
#pragma once

#include <memory>
#include <vector>

#include "hal/can/bus.h"
#include "hal/hardware.h"
#include "services/runtime/process.h"

namespace tandem::hal_service {

/** The hardware file of a deployment.
 * @throw config::Error where the deployment names none, or one for another robot, or runs in lock-step. */
hal::HardwareConfig loadHardwareOf(const runtime::Setup& setup);

/** Opens all buses; what is not there yet is waited for, for up to `timeout` s: interfaces come up and simulated
 * drives start at their own pace. Links with another bit rate than planned are refused, links that restart by
 * themselves after bus-off warned of.
 * @return empty where a stop was requested. @throw std::runtime_error naming the bus and why. */
std::vector<std::unique_ptr<hal::can::Bus>> openBuses(const hal::HardwareConfig& hardware,
                                                      const runtime::StopSignal& stop,
                                                      double timeout);

}  // namespace tandem::hal_service
