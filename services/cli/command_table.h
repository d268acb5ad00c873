// SPDX-License-Identifier: Apache-2.0
/** @file Properties of all commands: examples in --help, and --json. */
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace tandem::cli {

/// First argument with which a test asks whether a command line is valid, without running it; its words follow.
inline constexpr const char* kParse = "__parse";
/// First argument with which scripts ask for the words of all commands, one command a line.
inline constexpr const char* kCommands = "__commands";

/// Ends the help of each command with its examples, and gives --json to each that has no such option: results, and the
/// reasons of refusals, are then JSON on standard output. @throw std::logic_error for a command without examples
void completeCommands(CLI::App& app);

/// Words of all commands without subcommands: "robot run".
std::vector<std::string> commandsOf(const CLI::App& app);

}  // namespace tandem::cli
