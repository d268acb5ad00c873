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

/** Messages of one file, each by the schema that the file carries for it. Types that Tandem does not know stay as they
 * are. */
class MessageUpgrader {
 public:
  /// @param reader  outlives this
  explicit MessageUpgrader(const recording::Reader& reader) : reader_(reader) {}

  /// What has changed, for people; empty where nothing has.
  /// @throw recording::Error where a member is of another type today: such messages cannot be converted.
  std::string changes(const recording::Channel& channel);

  /// A message as today's type; the same bytes where nothing has changed. @throw as changes()
  /// @return nothing where the bytes are no such message
  std::optional<std::string> operator()(const recording::Channel& channel, std::string_view bytes);
  /// Bytes of today's type as the file has them, to compare. @throw, @return as above
  std::optional<std::string> back(const recording::Channel& channel, std::string_view bytes);

 private:
  struct Pair {
    recording::Conversion forth, back;
  };
  /// @return nothing where there is nothing to convert
  const Pair* pair(const recording::Channel& channel);

  const recording::Reader& reader_;
  std::map<std::uint16_t, std::optional<Pair>> pairs_;  ///< by schema
};

}  // namespace tandem::recordings
