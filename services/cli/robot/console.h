// SPDX-License-Identifier: Apache-2.0
/** @file Address of a deployment's console. */
#pragma once

#include <string>

#include "config/config.h"

namespace tandem::cli {

/// IPv4 address at which this machine reaches the console.
std::string consoleAddress(const config::Console& console);
/// "http://127.0.0.1:8765/".
std::string consoleUrl(const config::Console& console, int port);

}  // namespace tandem::cli
