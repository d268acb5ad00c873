// SPDX-License-Identifier: Apache-2.0
#include "services/console/numbers.h"

#include <charconv>
#include <cmath>
#include <stdexcept>

namespace tandem::console {

std::optional<double> finiteNumber(std::string_view text) {
  double value = 0.0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = status == std::errc() && end == text.data() + text.size() && std::isfinite(value);
  return whole ? std::optional(value) : std::nullopt;
}

double numberOf(const std::string& parameter,
                std::string_view text,
                const std::string& expected,
                double least,
                double most) {
  const auto value = finiteNumber(text);
  if (!value || *value < least || *value > most)
    throw std::invalid_argument(parameter + ": found '" + std::string(text.substr(0, 40)) + "', expected " + expected);
  return *value;
}

}  // namespace tandem::console
