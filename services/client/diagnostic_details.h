// SPDX-License-Identifier: Apache-2.0
/** @file Values of the services' diagnostics, for the command line. */
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "services/client/client.h"

namespace tandem::client {

/** Values of all services' diagnostics whose keys begin with `prefix` (runtime/diagnostics.h): by service, then by the
 * rest of the key. */
nlohmann::ordered_json diagnosticDetails(const Snapshot& snapshot, const std::string& prefix);

/// Lines "arm_a translation 1 failed: WHY" that begin with `indent`. @param failed  diagnosticDetails() of
/// runtime::kFailedKey
std::string describeFailed(const nlohmann::ordered_json& failed, const std::string& indent);

}  // namespace tandem::client
