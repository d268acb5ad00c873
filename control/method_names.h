// SPDX-License-Identifier: Apache-2.0
/** @file The methods by their names, for messages and for what offers a choice. */
#pragma once

#include <string>
#include <vector>

namespace tandem::control {

/// In the order of Method: "nsp", "nspwln" ...
std::vector<std::string> methodNames();
/// What a message expects: "nsp, nspwln ... or hqp".
std::string methodList();

}  // namespace tandem::control
