// SPDX-License-Identifier: Apache-2.0
/** @file What time it is on a host. */
#pragma once

#include <cstdint>
#include <string>

namespace tandem::dds {

/// clock/request, everyone -> every service: what time is it there? tandem_msgs/ClockRequest
struct ClockRequest {
  std::uint64_t client = 0;
  std::uint64_t request = 0;
};

/// clock/reply, every service -> all. Wall clock of its host. tandem_msgs/ClockReply
struct ClockReply {
  std::uint64_t client = 0;
  std::uint64_t request = 0;
  std::string process;        ///< "control"
  std::string host;           ///< as the deployment calls it; empty without hosts
  std::int64_t received = 0;  ///< when the request came, ns since 1970
  std::int64_t sent = 0;      ///< when this left, ns since 1970
};

}  // namespace tandem::dds
