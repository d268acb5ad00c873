// SPDX-License-Identifier: Apache-2.0
/** @file Node guarding (CiA 301): the master asks a node for its state by remote frames, and the node notices their
 * end. */
#pragma once

#include <cstdint>

#include "hal/canopen/cob.h"

namespace tandem::hal::canopen {

/** Remote frame that asks a node for its state. */
CanFrame guardFrame(int node) noexcept;

/** Node guarding of one node, on the master's side. Times are ns on the caller's clock. */
class NodeGuard {
 public:
  /// @param period  between two requests, ns; 0: the node has a heartbeat instead
  explicit NodeGuard(std::int64_t period) noexcept : period_(period) {}

  bool used() const noexcept { return period_ > 0; }
  /// The node has booted: its next toggle bit is 0.
  void restart() noexcept;
  bool due(std::int64_t now) const noexcept { return used() && now >= next_; }
  void sent(std::int64_t now) noexcept;
  /** The state in an answer, or in a boot-up message. The toggle bit of answers alternates, so that an answer to an
   * older request does not count; after a lost answer the next one is ignored. @return false: not a new state */
  bool take(std::uint8_t byte, NmtState& state) noexcept;

 private:
  std::int64_t period_;
  std::int64_t next_ = 0;
  std::uint8_t toggle_ = 0;  ///< expected bit 7
};

}  // namespace tandem::hal::canopen
