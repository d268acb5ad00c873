// SPDX-License-Identifier: Apache-2.0
/** @file Termination signals of a process. */
#pragma once

#include <csignal>
#include <string>

namespace tandem::runtime {

/// Why this process ends, for people: the signal; empty while no stop is requested.
std::string reasonOfStop();

/** Catches SIGINT, SIGTERM and SIGHUP during its lifetime, and ignores SIGXFSZ: at a limit of file sizes write() fails
 * as on a full disk, and the process goes on. One per process; create it before any thread. */
class StopSignal {
 public:
  /// @throw std::logic_error if the process has one already, std::system_error if the kernel grants no eventfd.
  StopSignal();
  /// Restores the previous signal handlers.
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  /// Whether a signal was received, or request() was called. Wait-free.
  bool requested() const noexcept;
  /// The first signal received; 0 for request() or none.
  int signal() const noexcept;
  /// Waits up to `seconds` (negative: without limit). @return requested().
  bool waitFor(double seconds) const;
  /// Readable once a stop is requested, for poll().
  int fd() const noexcept;
  /// Requests a stop; any thread may call it.
  void request() noexcept;

 private:
  struct sigaction old_interrupt_ {};
  struct sigaction old_terminate_ {};
  struct sigaction old_hangup_ {};
  struct sigaction old_file_size_ {};
};

}  // namespace tandem::runtime
