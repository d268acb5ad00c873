// SPDX-License-Identifier: Apache-2.0
/** @file Offsets between the clocks of the deployment's hosts and of this host, for logs and recordings. Control does
 * not use them. */
#pragma once

#include <array>
#include <chrono>
#include <deque>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "services/dds/bus.h"

namespace tandem::client {

/** Wall clock of a host relative to this host's. */
struct ClockOffset {
  std::string host;
  double offset = 0.0;  ///< other host minus this host, s
  double within = 0.0;  ///< half of the round trip, the largest possible error of the offset, s
};

/** Requests the time from services, and uses the reply with the shortest round trip of the last ones (as NTP does, RFC
 * 5905, section 8: theta = ((T2 - T1) + (T3 - T4)) / 2, delta = (T4 - T1) - (T3 - T2)). */
class Clocks {
 public:
  Clocks(dds::Bus& bus, std::uint64_t client);

  /// Sends one request; replies are processed on DDS threads.
  void requestTimes();
  /// Whether a service has replied: then it has discovered all readers and writers that this client created before this
  /// object, and this client has discovered all of the service's.
  bool received(const std::string& process) const;
  /// The same; without a reply, repeats the request to all services, but not more often than every 100 ms. For waiting
  /// loops.
  bool found(const std::string& process);
  /// One per host that has replied, in alphabetical order.
  std::vector<ClockOffset> offsets() const;

 private:
  static constexpr std::size_t kKept = 8;  ///< replies per host
  void onReply(const dds::ClockReply& reply);

  std::uint64_t client_;
  mutable std::mutex mutex_;
  std::uint64_t request_ = 0;
  std::array<std::int64_t, 64> sent_{};                      ///< ns; index: request modulo size
  std::map<std::string, std::deque<ClockOffset>> received_;  ///< by host
  std::set<std::string> processes_;
  std::chrono::steady_clock::time_point requested_{};
  dds::Writer<dds::ClockRequest> requests_;
  dds::Reader replies_;
};

}  // namespace tandem::client
