// SPDX-License-Identifier: Apache-2.0
/** @file Replies on the control socket of tandem-drive-sim. */
#pragma once

#include <string>

#include "sim/drives/drive_bus.h"

namespace tandem::drive_sim {

/// State and counters of all drives and encoders, as one line of JSON. Positions in counts, times in s.
std::string reportState(sim::drives::DriveBus& bus);

/// Executes one line (see parseFaultCommand()). @return "ok", the state as JSON, or "error: ..."
std::string serveLine(sim::drives::DriveBus& bus, const std::string& line);

}  // namespace tandem::drive_sim
