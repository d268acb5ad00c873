// SPDX-License-Identifier: Apache-2.0
/** @file Identity of a process; refusal of messages from another robot or deployment (docs/design/identity.md). */
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "config/config.h"
#include "services/dds/bus.h"

namespace tandem::runtime {

/// Of robot and deployment, and of this definition of the wire.
std::uint64_t fingerprintOf(const config::Deployment& deployment) noexcept;

/// Of this process, for one bus. @param process  its name: "control"
dds::Identity identityOf(const config::Deployment& deployment, const std::string& process);

/// "control (pid 12 on robot-pc)".
std::string describe(const dds::Identity& identity);

/// Where two processes differ: "control (pid 12 on robot-pc) differs in control_period: 0.1 here, 0.05 there"; empty
/// where they agree.
std::string mismatch(const dds::Identity& ours, const dds::Identity& theirs);

/// Those who are on the bus, move the robot or its drives, and differ from this process: a sentence for each.
std::vector<std::string> mismatches(const dds::Bus& bus);

/** What a service does about messages of those who know another robot or deployment: it refuses requests in words, and
 * calls `stop` for the others, on DDS threads. Logs whom it meets, once each. */
class MismatchHandler {
 public:
  MismatchHandler(dds::Bus& bus, std::function<void(const dds::Reply&)> answer, std::function<void()> stop);
  ~MismatchHandler();
  MismatchHandler(const MismatchHandler&) = delete;

 private:
  void meet(const dds::Mismatch& met);
  /// Whether there is a service of our kind that its sender may mean.
  bool isForOtherService(const dds::Mismatch& met) const;
  std::string describe(const dds::Mismatch& met) const;

  dds::Bus& bus_;
  std::function<void(const dds::Reply&)> answer_;
  std::function<void()> stop_;
  std::uint64_t reported_ = 0;  ///< fingerprint
};

}  // namespace tandem::runtime
