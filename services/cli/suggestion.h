// SPDX-License-Identifier: Apache-2.0
/** @file Suggestions for misspelled subcommands and options. */
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace tandem::cli {

/// "Did you mean `robot`?" for the first word of a command line that is no subcommand where one is required (all
/// subcommands if none is similar), or for the first unknown long option (empty if none is similar). @param words
/// without the name of the program
std::string suggestion(const CLI::App& app, const std::vector<std::string>& words);

/// Names of an app's subcommands.
std::vector<std::string> subcommandsOf(const CLI::App& app);

/// Long options of a subcommand, and those of all that it belongs to.
std::vector<std::string> optionsOf(const CLI::App* app);

}  // namespace tandem::cli
