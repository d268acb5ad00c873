// SPDX-License-Identifier: Apache-2.0
/** @file Detection of a real robot on the network, before a replay publishes commands. */
#pragma once

#include <mutex>
#include <string>

#include "services/dds/raw.h"

namespace tandem::recordings {

/// Whether hal, sim, control or planning act on a topic: streams of the control path, and requests of clients.
bool actedUpon(const dds::TopicInfo& topic);

/** Detects a drive side on the network, other than the samples of this bus itself. */
class HalWatch {
 public:
  enum class DriveSource {
    kNothing,
    kSimulator,  ///< its hal/status has no buses
    kHardware,   ///< its hal/status has buses or cannot be decoded, or it does not publish hal/status
  };

  explicit HalWatch(dds::Bus& bus);

  /// Drive side detected so far. actuation/state without hal/status counts as kHardware.
  DriveSource driveSource() const;
  /// Description of the detection.
  std::string describe() const;

 private:
  void onStatus(const dds::RawSample& sample);

  mutable std::mutex mutex_;
  bool state_received_ = false, status_received_ = false, hardware_ = false;
  dds::Reader states_, statuses_;
};

}  // namespace tandem::recordings
