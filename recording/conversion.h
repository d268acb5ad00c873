// SPDX-License-Identifier: Apache-2.0
/** @file Conversion of messages between two definitions of the same type. */
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "recording/definition.h"

namespace tandem::recording {

/** Member by member, by name. What the new definition alone has is 0 or empty; what the old one alone has is left out.
 * Of arrays of different lengths the elements count as members. */
class Conversion {
 public:
  Conversion(Definition from, Definition to);

  /// Whether there is anything to convert.
  bool same() const { return added_.empty() && dropped_.empty() && mismatched_.empty() && !reordered_; }
  const std::vector<std::string>& added() const { return added_; }            ///< "recovery", "hardware_count[16..23]"
  const std::vector<std::string>& dropped() const { return dropped_; }        ///< in the same words
  const std::vector<std::string>& mismatched() const { return mismatched_; }  ///< "mass: float32 before, string after"

  /// @return nothing where the bytes do not fit the old definition, or members are unlike.
  std::optional<std::string> operator()(std::string_view bytes) const;

 private:
  void compare(const std::string& from, const std::string& to, const std::string& path, int depth);

  Definition from_, to_;
  std::vector<std::string> added_, dropped_, mismatched_;
  bool reordered_ = false;
};

}  // namespace tandem::recording
