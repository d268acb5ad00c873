// SPDX-License-Identifier: Apache-2.0
/** @file Suggestions for misspelled subcommands and options. */
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace tandem::cli {

/// "Did you mean `robot`?" for the first word of a command line that is no subcommand where one is required, or for the
/// first unknown long option; empty if nothing is similar. @param words  without the name of the program
std::string suggestion(const CLI::App& app, const std::vector<std::string>& words);

}  // namespace tandem::cli
