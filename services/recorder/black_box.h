// SPDX-License-Identifier: Apache-2.0
/** @file Black box: recorder of the last 30 s of all topics in memory of constant size, written to disk after a fault
 * or stop.
 *
 * Taking samples never waits for the disk: a thread of its own writes files. Where the disk is full or the folder
 * cannot be written, that is reported, and the robot goes on.
 */
#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "recording/sample_ring.h"
#include "services/recorder/fault_trigger.h"
#include "services/recordings/run_file.h"

namespace tandem::recorder {

/// Where files go: the deployment's folder; else STATE_DIRECTORY (systemd), XDG_STATE_HOME/tandem,
/// ~/.local/state/tandem or /var/lib/tandem, and black-box in it.
std::filesystem::path blackBoxDirectory(const config::Deployment& deployment);

class BlackBox {
 public:
  /// How it is, for diagnostics.
  struct Status {
    double held = 0.0;         ///< s of the robot's life in memory
    bool too_small = false;    ///< the memory does not hold what is asked for
    std::uint64_t faults = 0;  ///< faults and stops seen
    std::string last_event;    ///< words of the last of them
    std::uint64_t files = 0;   ///< written by this process
    std::string last_file;     ///< empty: none yet
    std::string problem;       ///< why the last file could not be written, or the next one will not be
  };

  /// @param robot  must outlive this object, as must the deployment
  BlackBox(const config::Deployment& deployment, const config::Robot& robot, std::vector<dds::TopicInfo> topics);
  /// Writes what is due, without waiting for its end.
  ~BlackBox();
  BlackBox(const BlackBox&) = delete;
  BlackBox& operator=(const BlackBox&) = delete;

  /// Takes a sample of the topic of that place in topics(). Any thread.
  void take(const recording::SampleTag& tag, std::string_view bytes);

  Status status() const;
  const std::vector<dds::TopicInfo>& topics() const { return topics_; }

 private:
  struct Event {
    std::uint64_t time = 0;  ///< ns since the epoch
    std::string words;
  };

  void run();
  void checkDirectory();
  void writeFile(const std::vector<Event>& events);
  void prune() const;

  const config::Deployment& deployment_;
  const std::vector<dds::TopicInfo> topics_;
  const std::filesystem::path directory_;
  const recordings::RunInfo info_;  ///< files may change later; these are the ones that the processes have read
  recording::SampleRing ring_;
  FaultTrigger trigger_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool ending_ = false;
  std::vector<Event> events_;
  Status status_;
  std::thread thread_;
};

}  // namespace tandem::recorder
