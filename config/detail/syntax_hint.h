// SPDX-License-Identifier: Apache-2.0
/** @file Likely causes of YAML syntax errors. */
#pragma once

#include <string>

namespace tandem::config {

/// Likely cause of a syntax error near a line (from 0), as a clause to append to its message: a tab as indentation, a
/// bracket or quote that is not closed, a colon without a blank after it; else the indentation.
std::string syntaxHint(const std::string& text, int line);

/// Whether a text is the fraction of a number that a decimal comma has cut off: "12" of `{length_mm: 3,12}`.
bool isCutOff(const std::string& key);

}  // namespace tandem::config
