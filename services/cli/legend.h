// SPDX-License-Identifier: Apache-2.0
/** @file Meanings of the words that tables and summaries print, for --help. */
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

namespace tandem::cli {

/// "What is printed:" and a line for each of these words. @throw std::logic_error for a word without a meaning
std::string legend(std::initializer_list<std::string_view> words);

}  // namespace tandem::cli
