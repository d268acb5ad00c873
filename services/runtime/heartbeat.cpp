// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/heartbeat.h"

#include <poll.h>
#include <spdlog/fmt/fmt.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <system_error>

namespace tandem::runtime {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000;
constexpr std::int64_t kLookForReady = 10 * kMillisecond;
constexpr std::int64_t kReportPeriod = 1000 * kMillisecond;

std::string_view variable(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

/// A positive integer; 0 for any other text.
std::int64_t number(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() && value > 0 ? value : 0;
}

/// Watchdog period, ns; 0 if none is set, or if it is for another process.
std::int64_t watchdogTime() {
  const std::string_view pid = variable("WATCHDOG_PID");
  if (!pid.empty() && number(pid) != getpid())
    return 0;
  return 1000 * number(variable("WATCHDOG_USEC"));
}

}  // namespace

Heartbeat::Heartbeat(const StopSignal& stop) : stop_(stop), address_(variable("NOTIFY_SOCKET")) {
  if (address_.empty())
    return;
  if ((address_[0] != '/' && address_[0] != '@') || address_.size() >= sizeof(sockaddr_un::sun_path)) {
    throw std::invalid_argument("NOTIFY_SOCKET: found '" + address_ +
                                "', expected the path of a socket, or @ and its name");
  }
  if (address_[0] == '@')
    address_[0] = '\0';
  watchdog_ = watchdogTime();
  socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  ended_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (socket_ < 0 || ended_ < 0)
    throw std::system_error(errno, std::generic_category(), "heartbeat");
  thread_ = std::thread([this] { run(); });
}

Heartbeat::~Heartbeat() {
  if (!active())
    return;
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(ended_, &one, sizeof(one));
  thread_.join();
  if (!stopping_)
    send("STOPPING=1");
  close(socket_);
  close(ended_);
}

void Heartbeat::beat() {
  if (!active())
    return;
  const std::lock_guard lock(mutex_);
  ++pulse_.rounds;
}

void Heartbeat::beat(const LoopStatistics& statistics) {
  if (!active())
    return;
  const std::lock_guard lock(mutex_);
  pulse_ = {statistics.cycles, statistics};
}

bool Heartbeat::feed() {
  Pulse now;
  {
    const std::lock_guard lock(mutex_);
    now = pulse_;
  }
  const std::uint64_t rounds = now.rounds - fed_.rounds, skipped = now.loop.skipped - fed_.loop.skipped;
  if (rounds == 0)
    return false;
  fed_ = now;
  return rounds >= skipped;
}

std::string Heartbeat::description(bool alive) const {
  if (!alive)
    return "the loop does not keep its period";
  const LoopStatistics& s = fed_.loop;
  if (s.cycles == 0)
    return "running";
  return fmt::format("{} cycles, {} overruns, {} periods left out, latest wake-up {:.3f} ms late", s.cycles, s.overruns,
                     s.skipped, 1e3 * s.lateness_max);
}

void Heartbeat::run() {
  std::int64_t look = 0, reported = 0;
  while (true) {
    const std::int64_t every = !ready_          ? kLookForReady
                               : watchdog_ != 0 ? std::min(watchdog_ / 4, kReportPeriod)
                                                : kReportPeriod;
    const std::int64_t left = std::max<std::int64_t>(0, look + every - monotonicNow());
    // A reported stop is not polled again: its descriptor stays readable.
    std::array<pollfd, 2> sources{{{ended_, POLLIN, 0}, {stopping_ ? -1 : stop_.fd(), POLLIN, 0}}};
    poll(sources.data(), sources.size(), static_cast<int>((left + kMillisecond - 1) / kMillisecond));
    if (sources[0].revents != 0)
      return;
    if (sources[1].revents != 0) {
      stopping_ = true;
      send("STOPPING=1\nSTATUS=stopping");
    }
    if (monotonicNow() < look + every)
      continue;
    look = monotonicNow();
    const bool alive = feed();
    if (alive && !ready_ && !stopping_) {
      ready_ = true;
      send("READY=1");
    }
    if (alive && watchdog_ != 0)
      send("WATCHDOG=1");
    if (ready_ && !stopping_ && look - reported >= kReportPeriod) {
      reported = look;
      send("STATUS=" + description(alive));
    }
  }
}

void Heartbeat::send(const std::string& state) const noexcept {
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  std::memcpy(to.sun_path, address_.data(), address_.size());
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address_.size());
  // Errors are ignored: a service manager that receives nothing acts by itself.
  [[maybe_unused]] const auto sent =
      sendto(socket_, state.data(), state.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&to), length);
}

}  // namespace tandem::runtime
