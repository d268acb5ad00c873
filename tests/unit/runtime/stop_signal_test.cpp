// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/stop_signal.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <stdexcept>
#include <thread>

#include "services/runtime/periodic_loop.h"

namespace tandem::runtime {
namespace {

bool readable(int fd) {
  pollfd waiting{fd, POLLIN, 0};
  return poll(&waiting, 1, 0) == 1;
}

TEST(StopSignal, HandlesBothSignalsAndRestoresHandlers) {
  for (const int number : {SIGINT, SIGTERM}) {
    StopSignal stop;
    EXPECT_FALSE(stop.requested());
    EXPECT_FALSE(readable(stop.fd()));
    EXPECT_FALSE(stop.waitFor(0.0));
    std::raise(number);
    EXPECT_TRUE(stop.requested());
    EXPECT_EQ(stop.signal(), number);
    EXPECT_TRUE(readable(stop.fd()));
    EXPECT_TRUE(stop.waitFor(-1.0));
  }
  struct sigaction now {};
  sigaction(SIGTERM, nullptr, &now);
  EXPECT_EQ(now.sa_handler, SIG_DFL);
}

TEST(StopSignal, ItsReasonIsNamed) {
  for (const auto& [number, name] : {std::pair{SIGINT, "SIGINT"}, {SIGTERM, "SIGTERM"}, {SIGHUP, "SIGHUP"}}) {
    struct sigaction ignored {};
    sigaction(SIGHUP, nullptr, &ignored);
    if (number == SIGHUP && ignored.sa_handler == SIG_IGN)
      continue;  // under nohup
    StopSignal stop;
    EXPECT_EQ(reasonOfStop(), "");
    std::raise(number);
    EXPECT_TRUE(reasonOfStop().starts_with(name)) << reasonOfStop();
  }
  StopSignal stop;
  stop.request();
  EXPECT_EQ(reasonOfStop(), "it is done");
}

TEST(StopSignal, ALimitOfFileSizesIsNone) {
  StopSignal stop;
  std::raise(SIGXFSZ);
  EXPECT_FALSE(stop.requested());
}

TEST(StopSignal, ThereIsOnePerProcess) {
  StopSignal stop;
  EXPECT_THROW(StopSignal{}, std::logic_error);
}

TEST(StopSignal, RequestWakesAWaiter) {
  StopSignal stop;
  std::thread other([&] { stop.request(); });
  EXPECT_TRUE(stop.waitFor(20.0));
  other.join();
  EXPECT_EQ(stop.signal(), 0);
}

TEST(StopSignal, WaitsForTheGivenTime) {
  StopSignal stop;
  const std::int64_t begin = monotonicNow();
  EXPECT_FALSE(stop.waitFor(0.05));
  EXPECT_GE(monotonicNow() - begin, 50'000'000);
}

}  // namespace
}  // namespace tandem::runtime
