// SPDX-License-Identifier: Apache-2.0
/** @file Offsets between the clocks of a deployment's hosts and this one's, for logs and recordings. Control needs none
 * of them. */
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

/** Wall clock of a host against this one's. */
struct ClockOffset {
  std::string host;
  double offset = 0.0;  ///< theirs minus ours, s
  double within = 0.0;  ///< half of the round trip: the offset is no farther off than this, s
};

/** Asks services for the time, and believes the answer that was the fastest of the last ones (as NTP does, RFC 5905,
 * section 8: theta = ((T2 - T1) + (T3 - T4)) / 2, delta = (T4 - T1) - (T3 - T2)). */
class Clocks {
 public:
  Clocks(dds::Bus& bus, std::uint64_t client);

  /// Asks once; answers come by themselves.
  void ask();
  /// Whether a service has answered: then it has found all ends that this client made before this object, and this
  /// client has found all of its.
  bool received(const std::string& process) const;
  /// The same; where it has not, asks everybody again, but not more often than every 100 ms. For loops that wait.
  bool found(const std::string& process);
  /// One a host that has answered, in alphabetical order.
  std::vector<ClockOffset> offsets() const;

 private:
  static constexpr std::size_t kKept = 8;  ///< answers a host
  void onReply(const dds::ClockReply& reply);

  std::uint64_t client_;
  mutable std::mutex mutex_;
  std::uint64_t request_ = 0;
  std::array<std::int64_t, 64> sent_{};                      ///< when, by request modulo its size
  std::map<std::string, std::deque<ClockOffset>> received_;  ///< by host
  std::set<std::string> processes_;
  std::chrono::steady_clock::time_point asked_{};
  dds::Writer<dds::ClockRequest> requests_;
  dds::Reader replies_;
};

}  // namespace tandem::client
