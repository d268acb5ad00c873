// SPDX-License-Identifier: Apache-2.0
/** @file Method, its parameters and the gains, as clients set them by name. */
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "control/parameters.h"
#include "planning/gains.h"

namespace tandem::planning {

/** What a tracker follows references with. */
struct MethodSettings {
  control::Method method = control::Method::kNspqp;
  control::MethodParameters parameters;
  Gains gains;

  /// Sets one value by its name: "bounds", "relative_gain", "tip_gain" or one of control::kTunableParameters. The
  /// backend has no name: Ipopt allocates and waits, which the periodic path does not permit.
  /// @param text  a number in SI units; of "bounds": coupled or frozen
  /// @throw std::invalid_argument  with name, found and expected value
  void set(const std::string& name, const std::string& text);

  /// All that set() sets, as pairs of name and text; set() of each pair restores the value exactly.
  std::vector<std::pair<std::string, std::string>> values() const;
};

}  // namespace tandem::planning
