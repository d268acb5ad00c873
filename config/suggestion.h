// SPDX-License-Identifier: Apache-2.0
/** @file Suggestions for misspelled words. */
#pragma once

#include <string>
#include <vector>

namespace tandem::config {

/// Number of insertions, deletions, replacements and swaps of neighbours between two texts.
int editDistance(const std::string& a, const std::string& b);

/// The known word with the smallest edit distance to `word`, at most two, or a third of the length of a long word;
/// empty if there is none.
std::string nearestWord(const std::string& word, const std::vector<std::string>& known);

}  // namespace tandem::config
