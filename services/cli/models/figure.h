// SPDX-License-Identifier: Apache-2.0
/** @file Figures from CSV files, drawn by a Python script. */
#pragma once

#include <string>
#include <vector>

namespace tandem::cli {

/// Runs experiments/SCRIPT with arguments; what it prints goes to stderr, as stdout may be JSON.
/// @throw Failure where it fails.
void drawFigures(const std::string& script, const std::vector<std::string>& arguments);

}  // namespace tandem::cli
