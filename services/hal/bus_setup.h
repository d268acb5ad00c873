// SPDX-License-Identifier: Apache-2.0
/** @file Opening of the buses of a hardware file. */
#pragma once

#include <memory>
#include <vector>

#include "hal/fieldbus.h"
#include "hal/hardware.h"
#include "services/runtime/process.h"

namespace tandem::hal_service {

/** Loads the hardware file of a deployment.
 * @throw config::Error if the deployment names none or one for another robot, if it runs in lock-step, or if the bus
 * period exceeds the control period. */
hal::HardwareConfig loadHardwareOf(const runtime::Setup& setup);

/** Opens all buses, those of libraries too; waits up to `timeout` s for missing ones, because interfaces and simulated
 * drives may start later. Refuses links with another bit rate than in the hardware file; warns about links that restart
 * automatically after bus-off.
 * @return empty if a stop was requested. @throw std::runtime_error with the bus and the reason. */
std::vector<std::unique_ptr<hal::Fieldbus>> openBuses(const hal::HardwareConfig& hardware,
                                                      const safety::Budgets& budgets,
                                                      const runtime::StopSignal& stop,
                                                      double timeout);

/** Loads the library of a bus (hal::FieldbusLibrary), which stays loaded, and opens the bus.
 * @throw std::runtime_error with path, what was found and what was expected, or what the library throws. */
std::unique_ptr<hal::Fieldbus> openLibrary(const hal::HardwareConfig& hardware, int bus);

}  // namespace tandem::hal_service
