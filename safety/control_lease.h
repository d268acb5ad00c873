// SPDX-License-Identifier: Apache-2.0
/** @file Control lease: exclusive command rights of one client, renewed by heartbeat. */
#pragma once

#include <cstdint>

#include "safety/watchdog.h"

namespace tandem::safety {

/** The lease. Reads no clock: times are ns on the caller's clock. Client 0: no client. */
class ControlLease {
 public:
  /// @param budget time without heartbeat after which the lease is lost (Budgets::lease), s.
  explicit ControlLease(double budget) : watchdog_(budget) {}

  /// Owner of the lease; 0 = free: released, or the owner's heartbeat timed out.
  std::uint64_t owner(std::int64_t now) const noexcept { return watchdog_.expired(now) ? 0 : client_; }
  bool isOwner(std::uint64_t client, std::int64_t now) const noexcept { return client != 0 && owner(now) == client; }

  /// Acquires a free lease, or renews the client's own. False: another client has it, or the client is 0.
  /// @param answered  when the message that the client answers was sent: the age of a heartbeat counts from then
  bool acquire(std::uint64_t client, std::int64_t now, std::int64_t answered) noexcept {
    if (client == 0 || (owner(now) != 0 && owner(now) != client))
      return false;
    client_ = client;
    watchdog_.feed(answered);
    return true;
  }
  bool acquire(std::uint64_t client, std::int64_t now) noexcept { return acquire(client, now, now); }

  /// Renews. False: the client does not have the lease (any more) and must acquire it again.
  bool keep(std::uint64_t client, std::int64_t now) noexcept { return isOwner(client, now) && acquire(client, now); }

  /// Releases. False: the client does not have the lease.
  bool release(std::uint64_t client, std::int64_t now) noexcept {
    if (!isOwner(client, now))
      return false;
    client_ = 0;
    return true;
  }

  /** True once after the owner's heartbeat timed out without a release; the caller latches Fault::kLeaseLost if an arm
   * moves. */
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
