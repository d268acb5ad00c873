// SPDX-License-Identifier: Apache-2.0
/** @file Subcommands implemented by separate programs. */
#pragma once

#include <string>
#include <vector>

namespace tandem::cli {

/// Replaces this process by the program of that name in the same folder. @throw Failure if it cannot be started.
[[noreturn]] void become(const std::string& program, const std::vector<std::string>& words);

}  // namespace tandem::cli
