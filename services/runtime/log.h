// SPDX-License-Identifier: Apache-2.0
/** @file Logging: "[time] [service] [level] text" on stderr, written by a separate thread. */
#pragma once

#include <spdlog/spdlog.h>

#include <string>

namespace tandem::runtime {

/** Creates the process's logger; afterwards spdlog::info() and the like use it.
 * @param service its name in every line.
 * @param level of stderr: trace, debug, info, warn, error, critical or off; empty: environment variable TANDEM_LOG,
 * else info. Added sinks get lines from info on, or from this level on if it is lower.
 * @throw std::invalid_argument for an unknown level. */
void startLog(const std::string& service, const std::string& level = "");

/// Adds a sink besides stderr, which the logging thread calls; any thread may add or remove one.
void addLogSink(const spdlog::sink_ptr& sink);
void removeLogSink(const spdlog::sink_ptr& sink);

/// Writes pending lines and ends the logging thread. Call it before main() ends.
void stopLog();

}  // namespace tandem::runtime
