// SPDX-License-Identifier: Apache-2.0
/** @file Number formats of printed tables. */
#pragma once

#include <cstdio>
#include <string>

namespace tandem::experiments {

/// printf into a string of at most 255 characters.
template <class... Arguments>
std::string format(const char* pattern, Arguments... arguments) {
  char line[256];
  std::snprintf(line, sizeof line, pattern, arguments...);
  return line;
}

}  // namespace tandem::experiments
