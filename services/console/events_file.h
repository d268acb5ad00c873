// SPDX-License-Identifier: Apache-2.0
/** @file The history of events in a file, so that it outlives the server. */
#pragma once

#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <thread>
#include <vector>

#include "config/config.h"
#include "services/console/history.h"
#include "services/recordings/run_file.h"

namespace tandem::console {

/** Reads a history at the start and writes it when it has changed, on a thread of its own.
 *
 * The file is an MCAP file of the size of the history, which is replaced as a whole: a server that is killed leaves the
 * one before. A file that cannot be read, or written, is a line of the log and nothing more. */
class EventsFile {
 public:
  /// Fills the history, with what the file has of this robot and deployment, in messages of the present version.
  /// @param history  outlives this; not in use by other threads yet
  EventsFile(History& history,
             std::filesystem::path file,
             const config::Deployment& deployment,
             const config::Robot& robot);
  /// Writes what is new.
  ~EventsFile();
  EventsFile(const EventsFile&) = delete;
  EventsFile& operator=(const EventsFile&) = delete;

 private:
  void read(const config::Deployment& deployment);
  void write();
  void run();

  History& history_;
  const std::filesystem::path file_;
  const std::string prefix_;
  const std::vector<dds::TopicInfo> topics_;
  recordings::RunInfo info_;
  std::uint64_t written_ = 0;  ///< events of the history that the file has, or had
  bool failed_ = false;        ///< said already
  std::mutex mutex_;
  std::condition_variable changed_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace tandem::console
