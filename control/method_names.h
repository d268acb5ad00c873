// SPDX-License-Identifier: Apache-2.0
/** @file Names of the methods, for messages and for lists of choices. */
#pragma once

#include <string>
#include <vector>

namespace tandem::control {

/// In the order of Method: "nsp", "nspwln" ...
std::vector<std::string> methodNames();
/// What a message expects: "nsp, nspwln ... or hqp".
std::string methodList();

}  // namespace tandem::control
