// SPDX-License-Identifier: Apache-2.0
/** @file Recording of all topics to an MCAP file, which operators start, mark and stop at the page. */
#pragma once

#include <condition_variable>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "services/dds/bus.h"
#include "services/recordings/recorder.h"

namespace tandem::console {

/** One recording at a time, as of `tandem record`, on a thread of its own: no method waits for the disk or for DDS. */
class Recording {
 public:
  /// @param bus  options of a bus that reads all topics @param folder  of the files; created with the first one
  Recording(const config::Deployment& deployment,
            const config::Robot& robot,
            dds::BusOptions bus,
            std::filesystem::path folder);
  /// Completes the file.
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  /// @throw std::invalid_argument if it records already.
  void start();
  /// Completes the file, which takes up to a few seconds: state() reports the end. @throw std::invalid_argument if it
  /// does not record.
  void stop();
  /// Adds a mark with the present time to the file. @throw std::invalid_argument if it does not record, or the text is
  /// empty or longer than 200 bytes.
  void mark(const std::string& text);

  /// Whether it records, file, s, messages, lost samples, bytes and marks of this or the last recording, and why that
  /// ended early.
  nlohmann::ordered_json state() const;

 private:
  struct Mark {
    std::uint64_t time = 0;  ///< ns since the epoch
    std::string text;
  };

  void run(const std::filesystem::path& file);
  void record(const std::filesystem::path& file);

  const std::string prefix_;
  const std::vector<dds::TopicInfo> topics_;
  const recordings::RunInfo info_;
  const dds::BusOptions bus_;
  const std::filesystem::path folder_;
  const std::string name_;
  mutable std::mutex mutex_;  ///< of all members below but the thread
  std::condition_variable changed_;
  bool recording_ = false, ending_ = false;
  std::uint64_t began_ = 0, ended_ = 0;  ///< ns since the epoch
  std::vector<Mark> marks_;
  recordings::Recorder::Totals totals_;
  std::string problem_;
  std::thread thread_;
};

}  // namespace tandem::console
