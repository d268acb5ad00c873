// SPDX-License-Identifier: Apache-2.0
/** @file Text of tandem status, from its JSON. */
#pragma once

#include <nlohmann/json.hpp>

namespace tandem::cli {

/// Prints what `tandem status --json` prints, for people, to standard output.
void printStatus(const nlohmann::ordered_json& json);

}  // namespace tandem::cli
