// SPDX-License-Identifier: Apache-2.0
/** @file Checks of numbers on command lines, with messages for people. */
#pragma once

#include <CLI/CLI.hpp>
#include <cmath>
#include <string>

namespace tandem::client {

/// A finite number that satisfies `good`; the message says what was found and expected.
inline CLI::Validator numberCheck(const std::string& name, const std::string& expected, bool (*good)(double)) {
  return CLI::Validator(
      [=](const std::string& text) {
        double value = std::nan("");
        if (CLI::detail::lexical_cast(text, value) && !std::isfinite(value))
          return "found " + text + ", expected a finite number";
        return good(value) ? std::string() : "found " + text + ", expected " + expected;
      },
      name);
}

inline const CLI::Validator kPositive =
    numberCheck("POSITIVE", "a number above 0", [](double value) { return value > 0.0; });
inline const CLI::Validator kNonNegative =
    numberCheck("NONNEGATIVE", "a number from 0 on", [](double value) { return value >= 0.0; });

}  // namespace tandem::client
