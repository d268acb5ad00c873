// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/heartbeat.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <random>

namespace tandem::runtime {
namespace {

constexpr double kTimeout = 20.0;  // s, for events that take milliseconds on an idle machine

/** Simulated service manager: a socket, and the environment variables with its name. */
class Manager {
 public:
  explicit Manager(std::int64_t watchdog_ms, bool abstract = false) {
    const std::string unique = std::to_string(getpid()) + "-" + std::to_string(std::random_device{}());
    name_ = abstract ? "@tandem-" + unique : (std::filesystem::temp_directory_path() / ("tandem-" + unique)).string();
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    name_.copy(address.sun_path, name_.size());
    if (abstract)
      address.sun_path[0] = '\0';
    socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name_.size());
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), length), 0);
    setenv("NOTIFY_SOCKET", name_.c_str(), 1);
    setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
    setenv("WATCHDOG_USEC", std::to_string(1000 * watchdog_ms).c_str(), 1);
  }
  ~Manager() {
    close(socket_);
    if (name_[0] == '/')
      std::filesystem::remove(name_);
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_PID", "WATCHDOG_USEC"})
      unsetenv(name);
  }

  /// The next message within `seconds`.
  std::optional<std::string> next(double seconds) {
    pollfd source{socket_, POLLIN, 0};
    if (poll(&source, 1, static_cast<int>(1e3 * seconds)) <= 0)
      return std::nullopt;
    std::string text(4096, '\0');
    const ssize_t size = recv(socket_, text.data(), text.size(), 0);
    text.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    return text;
  }
  /// Whether a message with this text arrives in time; `meanwhile` is called while waiting.
  bool receives(
      const std::string& words,
      const std::function<void()>& meanwhile = [] {}) {
    const std::int64_t end = monotonicNow() + static_cast<std::int64_t>(1e9 * kTimeout);
    while (monotonicNow() < end) {
      meanwhile();
      const auto message = next(2e-3);
      if (message && message->find(words) != std::string::npos)
        return true;
    }
    return false;
  }
  /// Discards all messages received so far.
  void forget() {
    while (next(0.0)) {
    }
  }
  /// Number of watchdog messages within `seconds`.
  int feeds(double seconds) {
    int count = 0;
    const std::int64_t end = monotonicNow() + static_cast<std::int64_t>(1e9 * seconds);
    while (monotonicNow() < end) {
      const auto message = next(2e-3);
      count += message && message->find("WATCHDOG=1") != std::string::npos ? 1 : 0;
    }
    return count;
  }

 private:
  std::string name_;
  int socket_ = -1;
};

TEST(Heartbeat, IsNothingWithoutAManager) {
  unsetenv("NOTIFY_SOCKET");
  const StopSignal stop;
  Heartbeat heartbeat(stop);
  heartbeat.beat();
  heartbeat.beat(LoopStatistics{});
  EXPECT_FALSE(heartbeat.active());
}

TEST(Heartbeat, SaysReadyWithTheFirstBeatAndStopsOnce) {
  for (const bool abstract : {false, true}) {
    Manager manager(0, abstract);
    StopSignal stop;
    {
      Heartbeat heartbeat(stop);
      EXPECT_EQ(manager.next(0.1), std::nullopt) << "ready before anything ran";
      EXPECT_TRUE(manager.receives("READY=1", [&] { heartbeat.beat(); }));
      EXPECT_TRUE(manager.receives("STATUS=running", [&] { heartbeat.beat(); }));
      stop.request();
      EXPECT_TRUE(manager.receives("STOPPING=1"));
    }
    EXPECT_FALSE([&] {
      while (const auto message = manager.next(0.0)) {
        if (message->find("STOPPING=1") != std::string::npos)
          return true;
      }
      return false;
    }()) << "said twice";
  }
}

TEST(Heartbeat, SaysThatItStopsWhereNobodyAsked) {
  Manager manager(0);
  const StopSignal stop;
  { const Heartbeat heartbeat(stop); }
  EXPECT_EQ(manager.next(kTimeout), "STOPPING=1");
}

TEST(Heartbeat, FeedsTheWatchdogOnlyWhileTheLoopRuns) {
  Manager manager(40);
  const StopSignal stop;
  Heartbeat heartbeat(stop);
  PeriodicLoop loop(1e-3);
  std::atomic<bool> hang{false}, hanging{false}, end{false};
  std::thread runner([&] {
    loop.run([&](const Tick&) {
      heartbeat.beat(loop.statistics());
      hanging = hang.load();
      while (hang && !end)
        std::this_thread::yield();
      return !end;
    });
  });
  EXPECT_TRUE(manager.receives("READY=1"));
  EXPECT_TRUE(manager.receives("WATCHDOG=1"));
  EXPECT_TRUE(manager.receives("cycles, "));
  hang = true;
  while (!hanging)
    std::this_thread::yield();
  manager.forget();
  EXPECT_LE(manager.feeds(0.4), 1) << "fed by a loop that hangs";  // one from before; 40 if it runs
  end = true;
  runner.join();
}

TEST(Heartbeat, IsNotFedByALoopThatLeavesOutMoreThanItRuns) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_int_distribution<std::uint64_t> some(1, 20);
  Manager manager(8);
  const StopSignal stop;
  Heartbeat heartbeat(stop);
  LoopStatistics s;
  const auto run = [&](std::uint64_t share) {  // periods skipped for each that is run
    const std::uint64_t ran = some(random);
    s.cycles += ran;
    s.skipped += share * ran;
    heartbeat.beat(s);
  };
  EXPECT_TRUE(manager.receives("READY=1", [&] { run(0); }));
  EXPECT_TRUE(manager.receives("WATCHDOG=1", [&] { run(1); }));
  EXPECT_TRUE(manager.receives("does not keep its period", [&] { run(2); }));
  manager.forget();
  EXPECT_FALSE([&] {
    for (int k = 0; k < 100; ++k) {
      run(2);
      const auto message = manager.next(2e-3);
      if (message && message->find("WATCHDOG=1") != std::string::npos)
        return true;
    }
    return false;
  }());
  EXPECT_TRUE(manager.receives("WATCHDOG=1", [&] { run(0); }));
}

TEST(Heartbeat, LeavesTheWatchdogOfAnotherProcessAlone) {
  Manager manager(8);
  setenv("WATCHDOG_PID", "1", 1);
  const StopSignal stop;
  Heartbeat heartbeat(stop);
  EXPECT_TRUE(manager.receives("READY=1", [&] { heartbeat.beat(); }));
  for (int k = 0; k < 20; ++k) {
    heartbeat.beat();
    EXPECT_EQ(manager.feeds(5e-3), 0);
  }
}

TEST(Heartbeat, RefusesWhatIsNoAddress) {
  const StopSignal stop;
  for (const std::string& address : {std::string("relative"), "/" + std::string(200, 'x')}) {
    setenv("NOTIFY_SOCKET", address.c_str(), 1);
    EXPECT_THROW(Heartbeat heartbeat(stop), std::invalid_argument) << address;
  }
  unsetenv("NOTIFY_SOCKET");
}

}  // namespace
}  // namespace tandem::runtime
