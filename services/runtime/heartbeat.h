// SPDX-License-Identifier: Apache-2.0
/** @file Notifications to the service manager: ready, alive, stopping. */
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

#include "services/runtime/periodic_loop.h"
#include "services/runtime/stop_signal.h"

namespace tandem::runtime {

/** Implements systemd's notification protocol (sd_notify(3)): datagrams to the socket in NOTIFY_SOCKET. Without this
 * variable nothing is sent and no thread is started.
 *
 * - READY=1 with the first healthy beat.
 * - WATCHDOG=1 four times within WATCHDOG_USEC, as long as there were healthy beats since the last one. A process whose
 *   loop hangs, skips more periods than it runs, or whose publisher thread hangs sends none, and the service manager
 *   restarts it. This is not part of the stop chain: drives and HAL stop long before.
 * - STATUS=, for `systemctl status`, about once a second.
 * - STOPPING=1 when a stop is requested.
 *
 * A periodic thread posts its loop's statistics into an Outbox whose thread calls beat(): only cycles whose results
 * were published count, and the periodic thread itself neither locks nor sends here. */
class Heartbeat {
 public:
  /// Reads NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID; `stop` outlives this. Create it before enterRealtime().
  /// @throw std::invalid_argument for a NOTIFY_SOCKET that is no address, std::system_error if the kernel grants no
  /// socket.
  explicit Heartbeat(const StopSignal& stop);
  /// Sends STOPPING=1, if not sent before.
  ~Heartbeat();
  Heartbeat(const Heartbeat&) = delete;
  Heartbeat& operator=(const Heartbeat&) = delete;

  /// Reports one iteration of an event loop. Ordinary threads only: it locks.
  void beat();
  /// Reports the cycles of a periodic loop. Ordinary threads only: it locks.
  void beat(const LoopStatistics& statistics);

  /// Whether NOTIFY_SOCKET is set.
  bool active() const { return socket_ >= 0; }

 private:
  struct Pulse {
    std::uint64_t rounds = 0;
    LoopStatistics loop;
  };

  void run();
  bool feed();
  std::string description(bool alive) const;
  void send(const std::string& state) const noexcept;

  const StopSignal& stop_;
  std::string address_;  // of the socket; begins with '\0' for an abstract one
  int socket_ = -1;
  std::int64_t watchdog_ = 0;  // ns; 0: none
  std::mutex mutex_;
  Pulse pulse_;  // under mutex_
  Pulse fed_;    // value at the last check; own thread only
  bool ready_ = false, stopping_ = false;
  int ended_ = -1;  // eventfd
  std::thread thread_;
};

}  // namespace tandem::runtime
