// SPDX-License-Identifier: Apache-2.0
/** @file Names of the methods, for messages and for lists of choices. */
#pragma once

#include <string>
#include <vector>

namespace tandem::control {

/// Built-in methods, in the order of Method: "nsp", "nspwln" ...
std::vector<std::string> methodNames();
/// Expected values for messages: "nsp, nspwln ... hqp, or foreign with a method_library".
std::string methodList();

}  // namespace tandem::control
