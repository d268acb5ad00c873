// SPDX-License-Identifier: Apache-2.0
/** @file Key tables of all file kinds, and generators of JSON Schemas and documentation from them. */
#pragma once

#include <string>
#include <vector>

#include "config/key_table.h"

namespace tandem::config {

const Mapping& robotTable();
const Mapping& cooperativeTable();
const Mapping& experimentTable();
const Mapping& deploymentTable();
const Mapping& trajectoryTable();
const Mapping& pathTable();
const Mapping& hardwareTable();
/// The `plant` of a deployment.
const Mapping& plantTable();
/// The `teleoperation` of a deployment.
const Mapping& teleoperationTable();

/// "experiment", "deployment", "trajectory", "hardware", "path", and those of robotFiles().
const std::vector<std::string>& kinds();

/// The table of a kind. @throw std::invalid_argument for an unknown kind.
const Mapping& tableOf(const std::string& kind);

/// The key `tandem` of a kind of file.
Field kindField(const std::string& kind);
/// The key `robot` of what refers to a robot file.
Field robotField();

/// JSON Schema (draft 2020-12) of a kind of file: the text of config/schemas/KIND.schema.json.
std::string schema(const std::string& kind);

/// The keys of a kind of file as Markdown tables, one per mapping: a section of docs/configuration.md.
std::string keyTables(const std::string& kind);

/// The keys of a trajectory without the `tandem` line, for the files that embed trajectories.
std::vector<Field> trajectoryFields();

}  // namespace tandem::config
