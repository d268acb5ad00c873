// SPDX-License-Identifier: Apache-2.0
/** @file Conversion of recorded messages to the present message definitions. */
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "recording/conversion.h"
#include "recording/reader.h"

namespace tandem::recordings {

/** Converts the messages of one file by the schemas in the file. Types that Tandem does not define stay unchanged. */
class MessageUpgrader {
 public:
  /// @param reader  outlives this
  explicit MessageUpgrader(const recording::Reader& reader) : reader_(reader) {}

  /// Description of the changes; empty if none.
  /// @throw recording::Error if the type of a member has changed: such messages cannot be converted.
  std::string changes(const recording::Channel& channel);

  /// Converts a message to its present type; returns the same bytes if nothing has changed. @throw as changes()
  /// @return nothing if the bytes do not fit the definition
  std::optional<std::string> operator()(const recording::Channel& channel, std::string_view bytes);
  /// Converts bytes of the present type to the type in the file, for comparison. @throw, @return as above
  std::optional<std::string> back(const recording::Channel& channel, std::string_view bytes);

 private:
  struct Pair {
    recording::Conversion forth, back;
  };
  /// @return null if there is nothing to convert
  const Pair* pair(const recording::Channel& channel);

  const recording::Reader& reader_;
  std::map<std::uint16_t, std::optional<Pair>> pairs_;  ///< by schema
};

}  // namespace tandem::recordings
