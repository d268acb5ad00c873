// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/ros_time.h"

#include <cstdlib>

#include "services/runtime/clock_request_handler.h"
#include "services/runtime/periodic_loop.h"

namespace tandem::runtime {
namespace {

constexpr std::int64_t kAdopted = 1'000'000;  // ns
constexpr std::int64_t kTogether = 100'000;   // ns; a reading that took longer was interrupted
constexpr int kAttempts = 100;                // of the first reading

}  // namespace

std::int64_t RosTime::of(std::int64_t instant) noexcept {
  if (lock_step_)
    return instant;
  for (int k = 0; k < (known_ ? 1 : kAttempts); ++k) {
    const std::int64_t before = monotonicNow(), wall = wallNow(), after = monotonicNow();
    if (after - before <= kTogether || k + 1 == kAttempts)
      return of(instant, before, wall);
  }
  return instant + offset_;
}

std::int64_t RosTime::of(std::int64_t instant, std::int64_t monotonic, std::int64_t wall) noexcept {
  if (lock_step_)
    return instant;
  const std::int64_t offset = wall - monotonic;
  if (!known_ || std::abs(offset - offset_) > kAdopted)
    offset_ = offset;
  known_ = true;
  return instant + offset_;
}

}  // namespace tandem::runtime
