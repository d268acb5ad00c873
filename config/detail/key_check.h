// SPDX-License-Identifier: Apache-2.0
/** @file Error messages for unknown keys. */
#pragma once

#include <string>

#include "config/key_table.h"

namespace tandem::config {

/// All keys of a mapping, separated by commas, with their first unit.
std::string knownKeys(const Mapping& table);

/// "a key without its unit; expected outer_diameter_mm or ...", "unknown key; did you mean ...?", "unknown key; known
/// keys: ...".
std::string explainUnknownKey(const std::string& key, const Mapping& table);

/// Whether an unknown key is most likely this field: misspelled, with a wrong unit, or without a colon.
bool isMeant(const Field& field, const std::string& key);

}  // namespace tandem::config
