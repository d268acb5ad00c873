// SPDX-License-Identifier: Apache-2.0
/** @file Watchdog for the messages of one sender. */
#pragma once

#include <cmath>
#include <cstdint>

namespace tandem::safety {

/** Holds a budget and when it was last fed. Reads no clock: times are ns on the caller's clock. */
class Watchdog {
 public:
  /// @param budget longest silence, s.
  explicit Watchdog(double budget) : budget_(std::llround(budget * 1e9)) {}

  void feed(std::int64_t now) noexcept { fed_ = now; }
  /// Silent for longer than the budget.
  bool expired(std::int64_t now) const noexcept { return now - fed_ > budget_; }
  /// Time since it was fed, s.
  double silence(std::int64_t now) const noexcept { return 1e-9 * static_cast<double>(now - fed_); }

 private:
  std::int64_t budget_;
  std::int64_t fed_ = 0;
};

}  // namespace tandem::safety
