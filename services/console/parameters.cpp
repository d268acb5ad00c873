// SPDX-License-Identifier: Apache-2.0
#include "services/console/parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <string_view>

#include "services/runtime/diagnostics.h"
#include "services/runtime/method_library.h"

namespace tandem::console {
namespace {

/// The parameter in an entry of control's diagnostics; empty for other entries, and for parameters that are no numbers.
std::optional<Parameter> parameterIn(const dds::KeyValue& entry) {
  if (entry.key == runtime::kMethodKey)
    return Parameter{kMethodParameter, entry.value.substr(0, entry.value.find(':'))};  // foreign: NAME of FILE
  const std::string_view prefix = runtime::kParameterKey;
  if (!entry.key.starts_with(prefix))
    return std::nullopt;
  char* end = nullptr;
  const double value = std::strtod(entry.value.c_str(), &end);
  if (entry.value.empty() || *end != '\0')
    return std::nullopt;
  return Parameter{entry.key.substr(prefix.size()), value};
}

}  // namespace

std::vector<Parameter> Parameters::onDiagnostics(const dds::DiagnosticArray& diagnostics) {
  std::vector<Parameter> changed;
  const std::lock_guard lock(mutex_);
  for (const dds::DiagnosticStatus& status : diagnostics.status) {
    if (status.name != runtime::kControl)
      continue;
    for (const dds::KeyValue& entry : status.values) {
      const auto found = parameterIn(entry);
      if (!found)
        continue;
      const auto known = values_.find(found->name);
      if (known != values_.end() && known->second == found->value)
        continue;
      values_[found->name] = found->value;
      changed.push_back(*found);
    }
  }
  return changed;
}

void Parameters::set(const Parameter& parameter) {
  const std::lock_guard lock(mutex_);
  values_[parameter.name] = parameter.value;
}

std::vector<Parameter> Parameters::get(const std::vector<std::string>& names) const {
  std::vector<Parameter> found;
  const std::lock_guard lock(mutex_);
  for (const auto& [name, value] : values_) {
    if (names.empty() || std::find(names.begin(), names.end(), name) != names.end())
      found.push_back({name, value});
  }
  return found;
}

dds::ControlRequest requestFor(const Parameter& parameter) {
  dds::ControlRequest request;
  const bool method = parameter.name == kMethodParameter;
  if (method != std::holds_alternative<std::string>(parameter.value))
    throw std::invalid_argument(parameter.name + ": found " +
                                (method ? "a number, expected the name of a method" : "a text, expected a number"));
  if (method) {
    request.kind = static_cast<std::uint8_t>(dds::ControlKind::kSetMethod);
    request.text = std::get<std::string>(parameter.value);
  } else {
    request.kind = static_cast<std::uint8_t>(dds::ControlKind::kSetParameter);
    request.text = parameter.name;
    request.value = fmt::format("{}", std::get<double>(parameter.value));
  }
  return request;
}

}  // namespace tandem::console
