// SPDX-License-Identifier: Apache-2.0
/** @file Numbers in the queries of clients. */
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace tandem::console {

/// The finite number that the whole text is.
std::optional<double> finiteNumber(std::string_view text);

/// The same of a parameter, in a range.
/// @param expected  "a finite number, m or rad": for the refusal
/// @throw std::invalid_argument that has the name of the parameter, what was found and what was expected
double numberOf(const std::string& parameter,
                std::string_view text,
                const std::string& expected,
                double least = std::numeric_limits<double>::lowest(),
                double most = std::numeric_limits<double>::max());

}  // namespace tandem::console
