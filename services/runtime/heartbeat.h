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

/** Speaks systemd's notification protocol (sd_notify(3)): datagrams to the socket that NOTIFY_SOCKET names. Where that
 * is not set, nothing is sent and no thread is started.
 *
 * - READY=1 with the first healthy beat.
 * - WATCHDOG=1 four times within WATCHDOG_USEC, as long as there were healthy beats since the last one. A process whose
 *   loop hangs, or leaves out more periods than it runs, or whose outcome nobody sends any more, is silent and so is
 * ended and started again by the service manager. That is no part of the stop chain: drives and HAL stop long before.
 * - STATUS=, for `systemctl status`, about once a second.
 * - STOPPING=1 when a stop is requested.
 *
 * A periodic thread posts its loop's statistics into an Outbox whose thread calls beat(): what counts is a cycle whose
 * outcome could be sent, and the periodic thread itself neither locks nor sends here. */
class Heartbeat {
 public:
  /// Reads NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID; `stop` outlives this. Create it before the thread becomes a
  /// real-time one. @throw std::invalid_argument for a NOTIFY_SOCKET that is no address, std::system_error where the
  /// kernel grants no socket.
  explicit Heartbeat(const StopSignal& stop);
  /// Says that the process stops, if it has not been said.
  ~Heartbeat();
  Heartbeat(const Heartbeat&) = delete;
  Heartbeat& operator=(const Heartbeat&) = delete;

  /// A round of a loop that waits for events. Ordinary threads only: it locks.
  void beat();
  /// Cycles of a periodic loop, as it counts them itself. Ordinary threads only: it locks.
  void beat(const LoopStatistics& statistics);

  /// Whether somebody listens.
  bool active() const { return socket_ >= 0; }

 private:
  struct Pulse {
    std::uint64_t rounds = 0;
    LoopStatistics loop;
  };

  void run();
  bool feed();
  std::string words(bool alive) const;
  void send(const std::string& state) const noexcept;

  const StopSignal& stop_;
  std::string address_;  // of the socket; begins with '\0' for an abstract one
  int socket_ = -1;
  std::int64_t watchdog_ = 0;  // ns; 0: none
  std::mutex mutex_;
  Pulse pulse_;  // under mutex_
  Pulse fed_;    // as it was at the last look; own thread
  bool ready_ = false, stopping_ = false;
  int ended_ = -1;  // eventfd
  std::thread thread_;
};

}  // namespace tandem::runtime
