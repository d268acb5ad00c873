// SPDX-License-Identifier: Apache-2.0
/** @file Path files: shape, directions, size and duration of a motion of the common object, and the components that
 * are held constant. */
#pragma once

#include <filesystem>
#include <string>

#include "planning/object_path.h"

namespace tandem::config {

/** A path from YAML text: what planning gets over the wire. Its `length` stays at 1: it is that of what is moved, which
 * a path does not know.
 * @param origin  stands in errors for the file name
 * @throw Error that names file, line, key, what was found and what was expected. */
planning::ObjectPath parsePath(const std::string& yaml, const std::string& origin);

/// @throw Error
planning::ObjectPath loadPath(const std::filesystem::path& file);

/// A path as YAML text in SI units that parsePath reads back to the last digit: what goes to planning.
std::string formatPath(const planning::ObjectPath& path);

/// The kind of file that a text is, by its first key: "trajectory", "path". @throw Error where it is none that there is
std::string kindOfText(const std::string& yaml, const std::string& origin);

}  // namespace tandem::config
