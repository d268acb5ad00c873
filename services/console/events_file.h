// SPDX-License-Identifier: Apache-2.0
/** @file The history of events in a file, so that it outlives the server. */
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "config/config.h"
#include "services/console/history.h"
#include "services/recordings/run_file.h"

namespace tandem::console {

/** Reads a history at the start, and writes each new event at once, on a thread of its own.
 *
 * The file is an MCAP file. The first new event replaces it as a whole, by one with the whole history; further events
 * are appended, and it is replaced again when it has become larger than the history, or another server of the same
 * robot has replaced it: of two servers the file is of the one that ends last. Events are written to the disk itself
 * (fdatasync), all that came meanwhile at a time: a killed server or a power cut leaves all events that its thread has
 * written. A file that cannot be read, or written, is a line of the log and nothing more. */
class EventsFile {
 public:
  /// Fills the history, with what the file has of this robot and deployment, in messages of the present version.
  /// @param history  outlives this; not in use by other threads yet
  EventsFile(History& history,
             std::filesystem::path file,
             const config::Deployment& deployment,
             const config::Robot& robot);

 private:
  void read(const config::Deployment& deployment);
  /// @return false: it cannot be written now.
  bool write();
  void replace();
  void append(const std::vector<HistoryEvent>& events);
  void run(const std::stop_token& end);

  History& history_;
  const std::filesystem::path file_;
  const std::string prefix_;
  const std::vector<dds::TopicInfo> topics_;
  recordings::RunInfo info_;
  std::optional<recordings::RunFile> out_;  ///< the file, once it has been replaced
  std::uint64_t inode_ = 0;                 ///< of `out_`
  std::uint64_t in_file_ = 0;               ///< events in `out_`
  std::uint64_t written_ = 0;               ///< events of the history that the file has, or had
  bool failed_ = false;                     ///< said already
  std::jthread thread_;                     ///< its end writes what is new
};

}  // namespace tandem::console
