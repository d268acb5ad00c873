// SPDX-License-Identifier: Apache-2.0
/** @file Detection of a real robot on the network, before a replay publishes commands. */
#pragma once

#include <mutex>
#include <string>

#include "services/dds/raw.h"

namespace tandem::recordings {

/// Whether hal, sim, control or planning act upon a topic: streams of the control path, and what clients ask for.
bool actedUpon(const dds::TopicInfo& topic);

/** Listens for a drive side other than what this bus itself writes. */
class HalWatch {
 public:
  enum class DriveSource {
    kNothing,
    kSimulator,  ///< it says that it has no buses
    kHardware,   ///< it has, or it does not say what it is
  };

  explicit HalWatch(dds::Bus& bus);

  /// What was received so far; never less than before.
  DriveSource driveSource() const;
  /// For people.
  std::string describe() const;

 private:
  void onStatus(const dds::RawSample& sample);

  mutable std::mutex mutex_;
  bool state_received_ = false, status_received_ = false, hardware_ = false;
  dds::Reader states_, statuses_;
};

}  // namespace tandem::recordings
