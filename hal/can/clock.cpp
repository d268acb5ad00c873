// SPDX-License-Identifier: Apache-2.0
#include "hal/can/clock.h"

#include <ctime>

namespace tandem::hal::can {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

std::int64_t read(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<std::int64_t>(now.tv_sec) * kSecond + now.tv_nsec;
}

}  // namespace

std::int64_t monotonicNow() noexcept { return read(CLOCK_MONOTONIC); }

std::int64_t realtimeOffset() noexcept {
  // The wall clock is read between two readings of the monotonic clock: the error is half of their distance.
  const std::int64_t before = monotonicNow();
  const std::int64_t wall = read(CLOCK_REALTIME);
  const std::int64_t after = monotonicNow();
  return wall - (before + (after - before) / 2);
}

std::int64_t toMonotonic(std::int64_t realtime_stamp, std::int64_t now, std::int64_t offset) noexcept {
  const std::int64_t stamp = realtime_stamp - offset;
  return stamp > now || now - stamp > kSecond ? now : stamp;
}

}  // namespace tandem::hal::can
