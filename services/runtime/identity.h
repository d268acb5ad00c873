// SPDX-License-Identifier: Apache-2.0
/** @file Identity of a process; refusal of messages from another robot or deployment (docs/design/identity.md). */
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"
#include "services/dds/bus.h"

namespace tandem::runtime {

/// Fingerprint of robot, deployment and wire version.
std::uint64_t fingerprintOf(const config::Deployment& deployment) noexcept;

/// Identity of this process on one bus. @param process  its name: "control"
dds::Identity identityOf(const config::Deployment& deployment, const std::string& process);

/// "control (pid 12 on robot-pc)".
std::string describe(const dds::Identity& identity);

/// Line of the log for a request of a client: "request: disable, by tandem-cli (pid 12 on robot-pc)".
/// @param who  its identity, if it is known: otherwise the end of its number, "client 1f3a"
std::string requestLine(const std::string& what, std::uint64_t client, const std::optional<dds::Identity>& who);

/// "request refused: REASON, by ...".
std::string refusalLine(const std::string& reason, std::uint64_t client, const std::optional<dds::Identity>& who);

/// The same of this process, under a name.
std::string describeThisProcess(const std::string& process);

/// Difference of two processes: "control (pid 12 on robot-pc) uses another robot or deployment: ...", with the values
/// that differ; empty if their fingerprints are equal.
std::string mismatch(const dds::Identity& ours, const dds::Identity& theirs);

/// One description per process on the bus that moves the robot and has another fingerprint than this process.
std::vector<std::string> mismatches(const dds::Bus& bus);

/** Handles messages of other robots or deployments: refuses requests with a reason, and calls `stop` for all other
 * messages, on DDS threads. Logs every refused request, and other messages only if their fingerprint differs from the
 * last logged one. */
class MismatchHandler {
 public:
  MismatchHandler(dds::Bus& bus, std::function<void(const dds::Reply&)> answer, std::function<void()> stop);
  ~MismatchHandler();
  MismatchHandler(const MismatchHandler&) = delete;

 private:
  void meet(const dds::Mismatch& met);
  /// Whether another service with this process name matches the sender, and so receives the request.
  bool isForOtherService(const dds::Mismatch& met) const;
  std::string describe(const dds::Mismatch& met) const;

  dds::Bus& bus_;
  std::function<void(const dds::Reply&)> answer_;
  std::function<void()> stop_;
  std::uint64_t reported_ = 0;  ///< fingerprint of the last logged sender
};

}  // namespace tandem::runtime
