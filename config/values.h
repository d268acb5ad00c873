// SPDX-License-Identifier: Apache-2.0
/** @file Motion-relevant values of a robot and its deployment, compared between processes (docs/design/identity.md). */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace tandem::config {

struct Deployment;
class Map;

/// All values of a checked mapping that motion depends on, a line `KEY: VALUE` each, in the order of its table: SI,
/// with the defaults of what is absent, so that comments, the order of keys, and units do not show. Keys that the table
/// marks with Field::withoutMotion() are left out.
/// @param under  what stands in front of the keys: "robot."
std::string valuesOf(const Map& map, const std::string& under = "");

/// Those of the files that a deployment names: robot and hardware. @throw Error as their loaders do.
std::string valuesOfFiles(const Deployment& deployment);

/// 64-bit FNV-1a of the values and of a version of the wire; never 0.
std::uint64_t fingerprintOf(const std::string& values, std::uint64_t wire_version) noexcept;
/// As people read it: 16 hexadecimal digits.
std::string fingerprintText(std::uint64_t fingerprint);

/// Where two lists of values differ, by key, at most `most` of them: "control_period: 0.1 here, 0.05 there; ... and 3
/// more". Empty where they say the same.
std::string differences(const std::string& here, const std::string& there, std::size_t most = 4);

}  // namespace tandem::config
