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
const Mapping& driveTable();
/// Table of the `plant` of a deployment.
const Mapping& plantTable();
/// Table of the `teleoperation` of a deployment.
const Mapping& teleoperationTable();

/// "experiment", "deployment", "trajectory", "hardware", "drive", "path", and those of robotFiles().
const std::vector<std::string>& kinds();

/// Table of a kind. @throw std::invalid_argument for an unknown kind.
const Mapping& tableOf(const std::string& kind);

/// Key `tandem` of a kind of file.
Field kindField(const std::string& kind);
/// Key `robot` of files that refer to a robot file.
Field robotField();

/// JSON Schema (draft 2020-12) of a kind of file: the text of config/presets/schemas/KIND.schema.json.
std::string schema(const std::string& kind);

/// Keys of a kind of file as Markdown tables, one per mapping: in docs/configuration/KIND.md.
std::string keyTables(const std::string& kind);

/// Default of a key for people: "0.88 mm", "none", "required".
std::string defaultText(const Field& field);

/// Keys of a trajectory without `tandem`, for files that embed trajectories.
std::vector<Field> trajectoryFields();

}  // namespace tandem::config
