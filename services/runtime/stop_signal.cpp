// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/stop_signal.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <stdexcept>
#include <system_error>

#include "services/runtime/periodic_loop.h"

namespace tandem::runtime {
namespace {

// A signal handler has access only to globals.
std::atomic<int> g_event{-1};
std::atomic<int> g_signal{0};
std::atomic<bool> g_requested{false};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

void raiseRequest(int number) noexcept {
  int none = 0;
  if (number != 0 && !g_requested) {
    g_signal.compare_exchange_strong(none, number);
  }
  g_requested = true;
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(g_event, &one, sizeof(one));
}

void onSignal(int number) {
  const int saved = errno;
  raiseRequest(number);
  errno = saved;
}

}  // namespace

StopSignal::StopSignal() {
  if (g_event >= 0) {
    throw std::logic_error("a process has one StopSignal");
  }
  const int event = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (event < 0) {
    throw std::system_error(errno, std::generic_category(), "eventfd");
  }
  g_event = event;
  g_signal = 0;
  g_requested = false;
  struct sigaction action {};
  action.sa_handler = onSignal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, &old_interrupt_);
  sigaction(SIGTERM, &action, &old_terminate_);
  // Closing a terminal stops its processes as Ctrl-C does; SIGHUP stays ignored under nohup.
  sigaction(SIGHUP, nullptr, &old_hangup_);
  if (old_hangup_.sa_handler != SIG_IGN)
    sigaction(SIGHUP, &action, nullptr);
  action.sa_handler = SIG_IGN;
  sigaction(SIGXFSZ, &action, &old_file_size_);
}

StopSignal::~StopSignal() {
  sigaction(SIGINT, &old_interrupt_, nullptr);
  sigaction(SIGTERM, &old_terminate_, nullptr);
  sigaction(SIGHUP, &old_hangup_, nullptr);
  sigaction(SIGXFSZ, &old_file_size_, nullptr);
  close(g_event.exchange(-1));
}

std::string reasonOfStop() {
  if (!g_requested)
    return {};
  switch (g_signal.load()) {
    case SIGINT:
      return "SIGINT (Ctrl-C)";
    case SIGTERM:
      return "SIGTERM (another process asked for it, e.g. `tandem down` or systemd)";
    case SIGHUP:
      return "SIGHUP (its terminal was closed)";
    default:
      return "it is done";
  }
}

bool StopSignal::requested() const noexcept { return g_requested; }

int StopSignal::signal() const noexcept { return g_signal; }

int StopSignal::fd() const noexcept { return g_event; }

void StopSignal::request() noexcept { raiseRequest(0); }

bool StopSignal::waitFor(double seconds) const {
  const std::int64_t end = monotonicNow() + static_cast<std::int64_t>(std::max(seconds, 0.0) * 1e9);
  while (!requested()) {
    const std::int64_t left = (end - monotonicNow() + 999'999) / 1'000'000;  // ms, rounded up
    if (seconds >= 0.0 && left <= 0) {
      break;
    }
    pollfd waiting{fd(), POLLIN, 0};
    poll(&waiting, 1, seconds < 0.0 ? -1 : static_cast<int>(std::min<std::int64_t>(left, 60'000)));
  }
  return requested();
}

}  // namespace tandem::runtime
