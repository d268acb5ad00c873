// SPDX-License-Identifier: Apache-2.0
/** @file Completion of a command line in a shell. */
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace tandem::cli {

/// First argument with which the shell asks for candidates; the words of the command line follow.
inline constexpr const char* kComplete = "__complete";

/// Words that can stand in place of the last of `words`, which may be empty or the beginning of one: subcommands,
/// options, permitted values, names of presets. Empty where a file name is expected.
std::vector<std::string> completions(const CLI::App& app, const std::vector<std::string>& words);

}  // namespace tandem::cli
