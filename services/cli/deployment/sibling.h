// SPDX-License-Identifier: Apache-2.0
/** @file Subcommands implemented by separate programs. */
#pragma once

#include <string>
#include <vector>

namespace tandem::cli {

/// Goes on as the program of that name beside this one. @throw Failure where it cannot be started.
[[noreturn]] void become(const std::string& program, const std::vector<std::string>& words);

}  // namespace tandem::cli
