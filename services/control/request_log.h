// SPDX-License-Identifier: Apache-2.0
/** @file Log lines for requests of clients. Control writes them because it has received each request; other processes
 * may not yet have discovered a client that has just started. */
#pragma once

#include <map>
#include <string>
#include <vector>

#include "services/dds/bus.h"

namespace tandem::control_service {

/// "disable of arm A", "method nspqp"; empty for renewals of the lease. @param arms  names of the robot's arms
std::string describeRequest(const dds::ControlRequest& request, const std::vector<std::string>& arms);

/** Chooses what is logged: of a jog or hold that is repeated, the first request. */
class RequestLog {
 public:
  explicit RequestLog(std::vector<std::string> arms) : arms_(std::move(arms)) {}

  /// The line for a request: "request: disable, by tandem-cli (pid 1 on host)"; empty if there is none.
  /// @param now  ns, monotonic @param who  identity of the client, if it is known
  std::string line(const dds::ControlRequest& request, const std::optional<dds::Identity>& who, std::int64_t now);

 private:
  std::vector<std::string> arms_;
  std::map<std::string, std::int64_t> repeated_;  ///< time of the last one, ns, by line
};

}  // namespace tandem::control_service
