// SPDX-License-Identifier: Apache-2.0
/** @file Replies on the control socket of tandem-drive-sim. */
#pragma once

#include <string>

#include "sim/drives/drive_bus.h"

namespace tandem::drive_sim {

/// Everything that the drives and encoders know, as one line of JSON. Positions in counts, times in s.
std::string reportState(sim::drives::DriveBus& bus);

/// Does what a line asks (see parseFaultCommand()): "ok", the state as JSON, or "error: ...".
std::string serveLine(sim::drives::DriveBus& bus, const std::string& line);

}  // namespace tandem::drive_sim
