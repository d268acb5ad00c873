// SPDX-License-Identifier: Apache-2.0
/** @file Conversion of messages between two definitions of the same type. */
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "recording/definition.h"

namespace tandem::recording {

/** Converts member by member, by name. Members only in the new definition are 0 or empty; members only in the old one
 * are dropped. For arrays of different lengths this applies to their elements. */
class Conversion {
 public:
  Conversion(Definition from, Definition to);

  /// Whether both definitions have the same layout, so that nothing has to be converted.
  bool same() const { return added_.empty() && dropped_.empty() && mismatched_.empty() && !reordered_; }
  const std::vector<std::string>& added() const { return added_; }            ///< "recovery", "hardware_count[16..23]"
  const std::vector<std::string>& dropped() const { return dropped_; }        ///< in the same format
  const std::vector<std::string>& mismatched() const { return mismatched_; }  ///< "mass: float32 before, string after"

  /// @return nothing if the bytes do not fit the old definition, mismatched() is not empty, or the result would be
  /// longer than 64 MiB.
  std::optional<std::string> operator()(std::string_view bytes) const;

 private:
  void compare(const std::string& from, const std::string& to, const std::string& path);

  Definition from_, to_;
  std::vector<std::string> added_, dropped_, mismatched_;
  bool reordered_ = false;
};

}  // namespace tandem::recording
