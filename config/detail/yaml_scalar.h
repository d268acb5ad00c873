// SPDX-License-Identifier: Apache-2.0
/** @file Strict YAML scalars: no yes/no booleans, no quoted numbers, no NaN. */
#pragma once

#include <yaml-cpp/yaml.h>

#include <optional>
#include <string>

#include "config/key_table.h"

namespace tandem::config {

/// Description of a node for messages: "-1", `the text "abc"`, "a list of 3", "a mapping", "nothing".
std::string describeNode(const YAML::Node& node);

/// True for a scalar without quotes.
bool isPlain(const YAML::Node& node);

/// True if the scalar is one of the words of the field.
bool isWord(const YAML::Node& node, const Field& field);

/// A finite number in SI; empty if the scalar is no number or outside the field's range. Infinity for a word.
std::optional<double> readNumber(const YAML::Node& node, const Field& field, const Unit* unit);

/// An integer inside the field's range.
std::optional<long long> readInteger(const YAML::Node& node, const Field& field);

/// `true` or `false`; empty for any other text.
std::optional<bool> readBool(const YAML::Node& node);

/// A text that is not empty, is one of the words, and matches the pattern; a number or boolean without quotes is
/// refused unless the field accepts integers.
std::optional<std::string> readText(const YAML::Node& node, const Field& field);

}  // namespace tandem::config
