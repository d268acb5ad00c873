// SPDX-License-Identifier: Apache-2.0
/** @file ROS time: stamps of messages that ROS 2 defines. */
#pragma once

#include <cstdint>

namespace tandem::runtime {

/** ROS time of instants of this process: ns since 1970 on this host's wall clock; in lock-step simulated time, which
 * instants are already.
 *
 * The difference between the clocks is measured again at each use, and adopted where it has changed by more than 1 ms:
 * stamps follow a clock that is set, and have the intervals of the monotonic clock otherwise. For one thread. */
class RosTime {
 public:
  explicit RosTime(bool lock_step) : lock_step_(lock_step) {}
  /// @param instant  ns on this process's monotonic clock, or simulated time @return ns
  std::int64_t of(std::int64_t instant) noexcept;
  /// The same of clocks that were read together. @param monotonic, wall  now, ns
  std::int64_t of(std::int64_t instant, std::int64_t monotonic, std::int64_t wall) noexcept;

 private:
  bool lock_step_;
  bool known_ = false;
  std::int64_t offset_ = 0;  ///< wall clock minus monotonic clock, ns
};

}  // namespace tandem::runtime
