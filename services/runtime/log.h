// SPDX-License-Identifier: Apache-2.0
/** @file Logging: "[time] [service] [level] text" on stderr, written by a thread of its own. */
#pragma once

#include <spdlog/spdlog.h>

#include <string>

namespace tandem::runtime {

/** Makes the process's logger; afterwards spdlog::info() and friends go through it.
 * @param service its name in every line.
 * @param level trace, debug, info, warn, error, critical or off; empty: environment variable TANDEM_LOG, else info.
 * @throw std::invalid_argument for an unknown level. */
void startLog(const std::string& service, const std::string& level = "");

/// Sends the lines to one more place, besides stderr, from the thread of the log; any thread may add or remove one.
void addLogSink(const spdlog::sink_ptr& sink);
void removeLogSink(const spdlog::sink_ptr& sink);

/// Writes what is pending and ends the log's thread. Call it before main() ends.
void stopLog();

}  // namespace tandem::runtime
