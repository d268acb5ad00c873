// SPDX-License-Identifier: Apache-2.0
/** @file Path files: shape, directions, size and duration of a motion of the common object, and its constant
 * components. */
#pragma once

#include <filesystem>
#include <string>

#include "planning/object_path.h"

namespace tandem::config {

/** Parses a path in YAML, as planning receives it. Its `length` stays 1: it is that of the common object, which is not
 * part of a path.
 * @param origin replaces the file name in errors
 * @throw Error that names file, line, key, what was found and what was expected. */
planning::ObjectPath parsePath(const std::string& yaml, const std::string& origin);

/// @throw Error
planning::ObjectPath loadPath(const std::filesystem::path& file);

/// Path as YAML text in SI units that parsePath() reads back exactly, for requests to planning.
std::string formatPath(const planning::ObjectPath& path);

/// Kind of a text by its first key: "trajectory", "path". @throw Error for an unknown kind.
std::string kindOfText(const std::string& yaml, const std::string& origin);

}  // namespace tandem::config
