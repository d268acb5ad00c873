// SPDX-License-Identifier: Apache-2.0
/** @file Present values of the robot's parameters, as control reports them in its diagnostics. No sockets here. */
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "services/console/protocol.h"
#include "services/dds/messages.h"

namespace tandem::console {

/// Name of the parameter that selects the method.
inline constexpr const char* kMethodParameter = "method";

/** The values: the method by its name, gains and parameters of the method as numbers. Any thread. */
class Parameters {
 public:
  /// @return those that are new or have another value than before
  std::vector<Parameter> onDiagnostics(const dds::DiagnosticArray& diagnostics);
  /// A value that control has accepted: known before the next diagnostics.
  void set(const Parameter& parameter);
  /// Parameters with these names; all if `names` is empty. Unknown names are left out.
  std::vector<Parameter> get(const std::vector<std::string>& names) const;
  bool knows(const std::string& name) const { return !get({name}).empty(); }

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::variant<double, std::string>> values_;
};

/// The request to control for a new value: method, or parameter with a number. @throw std::invalid_argument if the
/// value is of the wrong kind; the message names parameter and kind
dds::ControlRequest requestFor(const Parameter& parameter);

}  // namespace tandem::console
