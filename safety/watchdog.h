// SPDX-License-Identifier: Apache-2.0
/** @file Watchdog for the messages of one sender. */
#pragma once

#include <cmath>
#include <cstdint>

namespace tandem::safety {

/** Time-out of one sender. Reads no clock: times are ns on the caller's clock. */
class Watchdog {
 public:
  /// @param budget longest time between two calls of feed(), s.
  explicit Watchdog(double budget) : budget_(std::llround(budget * 1e9)) {}

  void feed(std::int64_t now) noexcept { fed_ = now; }
  /// Whether the budget has passed since the last feed().
  bool expired(std::int64_t now) const noexcept { return now - fed_ > budget_; }
  /// Time since the last feed(), s.
  double silence(std::int64_t now) const noexcept { return 1e-9 * static_cast<double>(now - fed_); }

 private:
  std::int64_t budget_;
  std::int64_t fed_ = 0;
};

}  // namespace tandem::safety
