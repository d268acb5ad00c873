// SPDX-License-Identifier: Apache-2.0
#include "planning/method_settings.h"

#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>

namespace tandem::planning {
namespace {

constexpr const char* kBounds = "bounds";

double positiveNumber(const std::string& name, const std::string& text) {
  double value = 0.0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (status != std::errc() || end != text.data() + text.size() || !std::isfinite(value) || value <= 0.0)
    throw std::invalid_argument(name + ": found '" + text + "', expected a finite number above zero");
  return value;
}

/// Shortest text from which the same number is read.
std::string textOf(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

/// Calls f(name, value) with the gains and all tunable parameters.
template <class Settings, class F>
void forEachNumber(Settings& settings, F&& f) {
  f("relative_gain", settings.gains.relative);
  f("tip_gain", settings.gains.tip);
  for (const control::TunableParameter& parameter : control::kTunableParameters)
    f(parameter.name, settings.parameters.*parameter.member);
}

}  // namespace

void MethodSettings::set(const std::string& name, const std::string& text) {
  if (name == kBounds) {
    const auto bounds = idl::fromName<control::BoundsKind>(text);
    if (!bounds)
      throw std::invalid_argument(name + ": found '" + text + "', expected coupled or frozen");
    parameters.bounds = *bounds;
    return;
  }
  std::string names = kBounds;
  bool found = false;
  forEachNumber(*this, [&](const char* known, double& value) {
    names += std::string(", ") + known;
    if (name != known)
      return;
    value = positiveNumber(name, text);
    found = true;
  });
  if (!found)
    throw std::invalid_argument("found parameter '" + name + "', expected one of: " + names);
}

std::vector<std::pair<std::string, std::string>> MethodSettings::values() const {
  std::vector<std::pair<std::string, std::string>> all{{kBounds, std::string(name(parameters.bounds))}};
  forEachNumber(*this, [&all](const char* known, double value) { all.emplace_back(known, textOf(value)); });
  return all;
}

}  // namespace tandem::planning
