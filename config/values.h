// SPDX-License-Identifier: Apache-2.0
/** @file Motion-relevant values of a robot and its deployment, compared between processes (docs/design/identity.md). */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace tandem::config {

struct Deployment;
class Map;

/// All values of a checked mapping that motion depends on, one line `KEY: VALUE` each, in the order of its table.
/// Values are in SI, with defaults for absent keys, so that comments, the order of keys, and units make no difference.
/// Keys with Field::withoutMotion() are left out.
/// @param under prefix of the keys: "robot."
std::string valuesOf(const Map& map, const std::string& under = "");

/// Values of the files that a deployment names: robot and hardware. @throw Error as their loaders do.
std::string valuesOfFiles(const Deployment& deployment);

/// 64-bit FNV-1a of the values and of a version of the wire; never 0.
std::uint64_t fingerprintOf(const std::string& values, std::uint64_t wire_version) noexcept;
/// Text form for a person: 16 hexadecimal digits.
std::string fingerprintText(std::uint64_t fingerprint);

/// Differences of two lists of values, by key, at most `most` of them: "control_period: 0.1 here, 0.05 there; ... and 3
/// more". Empty if they are equal.
std::string differences(const std::string& here, const std::string& there, std::size_t most = 4);

}  // namespace tandem::config
