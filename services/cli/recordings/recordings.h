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

/** A recording, with topics called as in a deployment: below the prefix. */
class Recording {
 public:
  /// @throw Failure(kUsage) where it is no recording.
  explicit Recording(const std::string& file, recording::Reader::Open how = recording::Reader::Open::kFast);
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  recording::Reader& reader() { return reader_; }
  /// A value of the metadata `tandem`; empty where there is none.
  std::string about(const std::string& key) const;
  /// "/tandem/actuation/state" -> "actuation/state".
  std::string topicOf(const recording::Channel& channel) const;
  /// All topics, once, in the order of their first channels.
  std::vector<std::string> topics() const;
  /// A selection of the topics that match one of the patterns (* stands for any text).
  /// @throw Failure(kUsage) for a pattern that matches none.
  recording::Selection select(const std::vector<std::string>& patterns) const;
  /// The same topics, with times as s from the first message; `seconds` 0: to the end.
  recording::Selection select(const std::vector<std::string>& patterns, double start, double seconds) const;
  /// Each topic of the selection as a table. Messages that do not decode are reported on stderr.
  std::vector<recording::Table> tables(const recording::Selection& selection);
  /// What has changed of a channel's messages since; empty where nothing has.
  std::string changes(const recording::Channel& channel);
  /// A message as today's type, and back; what has changed is reported on stderr, once a topic. Nothing where the bytes
  /// do not fit. @throw Failure(kUsage) where that cannot be done.
  std::optional<std::string> today(const recording::Channel& channel, std::string_view bytes);
  std::optional<std::string> back(const recording::Channel& channel, std::string_view bytes);
  /// Data of an attachment. @throw Failure(kUsage) where there is none of that name.
  std::string attachment(const std::string& name);
  /// Tells on stderr what is wrong with the file. @return whether anything is.
  bool reportDamage() const;

 private:
  recording::Reader reader_;
  recordings::MessageUpgrader upgrader_;
  std::string prefix_;
  std::set<std::string> reported_;  ///< topics
};

}  // namespace tandem::cli
