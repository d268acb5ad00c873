// SPDX-License-Identifier: Apache-2.0
/** @file Black box: recorder of the last 30 s of all topics in memory of constant size, written to disk after a fault
 * or stop.
 *
 * take() never waits for the disk: a separate thread writes files. A full disk or an unwritable folder is reported, and
 * the robot continues.
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

/// Folder of the files: as in the deployment; else folder black-box in STATE_DIRECTORY (systemd),
/// XDG_STATE_HOME/tandem, ~/.local/state/tandem or /var/lib/tandem.
std::filesystem::path blackBoxDirectory(const config::Deployment& deployment);

class BlackBox {
 public:
  /// Status for diagnostics.
  struct Status {
    double held = 0.0;         ///< s, time span of the samples in memory
    bool too_small = false;    ///< the memory is too small for the required time span
    std::uint64_t faults = 0;  ///< faults and stops detected
    std::string last_event;    ///< description of the last one
    std::uint64_t files = 0;   ///< written by this process
    std::string last_file;     ///< empty: none yet
    std::string problem;       ///< reason why the last file could not, or the next one cannot, be written
  };

  /// @param robot  must outlive this object, as must the deployment
  BlackBox(const config::Deployment& deployment, const config::Robot& robot, std::vector<dds::TopicInfo> topics);

  /// Stores a sample; tag.topic is an index into topics(). Any thread.
  void take(const recording::SampleTag& tag, std::string_view bytes);

  Status status() const;
  const std::vector<dds::TopicInfo>& topics() const { return topics_; }

 private:
  struct Event {
    std::uint64_t time = 0;  ///< ns since the epoch
    std::string description;
  };

  void run(const std::stop_token& end);
  void checkDirectory();
  void writeFile(const std::vector<Event>& events);
  void prune() const;

  const config::Deployment& deployment_;
  const std::vector<dds::TopicInfo> topics_;
  const std::filesystem::path directory_;
  const recordings::RunInfo info_;  ///< configuration files as read at the start; they may change later
  recording::SampleRing ring_;
  FaultTrigger trigger_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::vector<Event> events_;
  Status status_;
  std::jthread thread_;  ///< at its end it writes pending events at once, without waiting for further samples
};

}  // namespace tandem::recorder
