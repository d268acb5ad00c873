// SPDX-License-Identifier: Apache-2.0
/** @file Termination signals of a process. */
#pragma once

#include <csignal>

namespace tandem::runtime {

/** Catches SIGINT, SIGTERM and SIGHUP as long as it lives. One per process; create it before any thread. */
class StopSignal {
 public:
  /// @throw std::logic_error where there is one already, std::system_error where the kernel grants no eventfd.
  StopSignal();
  /// Gives the signals back to whom they belonged.
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  /// Whether a signal came, or request() was called. Wait-free.
  bool requested() const noexcept;
  /// The signal that came first; 0 for request() or none.
  int signal() const noexcept;
  /// Waits up to so many s (negative: without end). @return requested().
  bool waitFor(double seconds) const;
  /// Readable once a stop is requested, for poll().
  int fd() const noexcept;
  /// Requests a stop from within, from any thread.
  void request() noexcept;

 private:
  struct sigaction old_interrupt_ {};
  struct sigaction old_terminate_ {};
  struct sigaction old_hangup_ {};
};

}  // namespace tandem::runtime
