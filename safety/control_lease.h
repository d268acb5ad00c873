// SPDX-License-Identifier: Apache-2.0
/** @file Control lease: exclusive command rights of one client, renewed by heartbeat. */
#pragma once

#include <cstdint>

#include "safety/watchdog.h"

namespace tandem::safety {

/** The lease. Reads no clock: times are ns on the caller's clock. Client 0 stands for nobody. */
class ControlLease {
 public:
  /// @param budget silence after which the lease is lost (Budgets::lease), s.
  explicit ControlLease(double budget) : watchdog_(budget) {}

  /// Who holds the lease now; 0 = free, because released or because its holder fell silent.
  std::uint64_t holder(std::int64_t now) const noexcept { return watchdog_.expired(now) ? 0 : client_; }
  bool holds(std::uint64_t client, std::int64_t now) const noexcept { return client != 0 && holder(now) == client; }

  /// Takes a free lease, or renews one's own. False: holder(now) has it, or the client is 0.
  bool acquire(std::uint64_t client, std::int64_t now) noexcept {
    if (client == 0 || (holder(now) != 0 && holder(now) != client))
      return false;
    client_ = client;
    watchdog_.feed(now);
    return true;
  }

  /// Renews. False: the client does not hold it (any more) and has to acquire it anew.
  bool keep(std::uint64_t client, std::int64_t now) noexcept { return holds(client, now) && acquire(client, now); }

  /// Gives it back. False: the client does not hold it.
  bool release(std::uint64_t client, std::int64_t now) noexcept {
    if (!holds(client, now))
      return false;
    client_ = 0;
    return true;
  }

  /** True once after a holder fell silent without releasing: the moment to latch Fault::kLeaseLost if an arm moves. */
  bool takeLoss(std::int64_t now) noexcept {
    if (client_ == 0 || !watchdog_.expired(now))
      return false;
    client_ = 0;
    return true;
  }

 private:
  Watchdog watchdog_;
  std::uint64_t client_ = 0;
};

}  // namespace tandem::safety
