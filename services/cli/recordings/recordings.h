// SPDX-License-Identifier: Apache-2.0
/** @file Helpers shared by the commands that read recordings. */
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "recording/reader.h"
#include "recording/table.h"
#include "services/recordings/message_upgrader.h"

namespace tandem::cli {

/** A recording, with topic names relative to the prefix, as in a deployment. */
class Recording {
 public:
  /// @throw Failure(kUsage) if the file is not a recording.
  explicit Recording(const std::string& file, recording::Reader::Open how = recording::Reader::Open::kFast);
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  recording::Reader& reader() { return reader_; }
  /// A value of the metadata `tandem`; empty if absent.
  std::string about(const std::string& key) const;
  /// "/tandem/actuation/state" -> "actuation/state".
  std::string topicOf(const recording::Channel& channel) const;
  /// All topics without duplicates, in the order of their first channels.
  std::vector<std::string> topics() const;
  /// Selection of the topics that match one of the patterns (* matches any text).
  /// @throw Failure(kUsage) for a pattern that matches none.
  recording::Selection select(const std::vector<std::string>& patterns) const;
  /// The same topics in a time range, s from the first message; `seconds` 0: to the end.
  recording::Selection select(const std::vector<std::string>& patterns, double start, double seconds) const;
  /// Each topic of the selection as a table. Messages that cannot be decoded are reported on stderr.
  std::vector<recording::Table> tables(const recording::Selection& selection);
  /// Changes of a channel's message type since the recording; empty if none.
  std::string changes(const recording::Channel& channel);
  /// Conversion of a message to the present type, and back; changes of the type are reported on stderr once per topic.
  /// Empty if the bytes do not match the type. @throw Failure(kUsage) if the types cannot be converted.
  std::optional<std::string> today(const recording::Channel& channel, std::string_view bytes);
  std::optional<std::string> back(const recording::Channel& channel, std::string_view bytes);
  /// Data of an attachment. @throw Failure(kUsage) if there is none of that name.
  std::string attachment(const std::string& name);
  /// Reports damage of the file on stderr. @return whether there is any.
  bool reportDamage() const;

 private:
  recording::Reader reader_;
  recordings::MessageUpgrader upgrader_;
  std::string prefix_;
  std::set<std::string> reported_;  ///< topics
};

}  // namespace tandem::cli
