// SPDX-License-Identifier: Apache-2.0
/** @file Text form of numbers that reads back to the same value. */
#pragma once

#include <charconv>
#include <string>

namespace tandem::config {

/// Shortest text that reads back as the same double.
inline std::string exact(double value) {
  char text[32];
  const auto [end, status] = std::to_chars(text, text + sizeof text, value);
  return {text, end};
}

}  // namespace tandem::config
