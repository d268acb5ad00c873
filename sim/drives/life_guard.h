// SPDX-License-Identifier: Apache-2.0
/** @file Node guarding (CiA 301) on the side of a device: answers to the master's remote frames, and their absence. */
#pragma once

#include <cstdint>

namespace tandem::sim::drives {

/** Answers with a toggle bit, and watches the master from its first request on. Times are ns. */
class LifeGuard {
 public:
  /// Communication reset.
  void restart() noexcept { *this = {}; }
  /// A request of the master. @return the answer's byte
  std::uint8_t answer(std::uint8_t state, std::int64_t now) noexcept {
    const auto byte = static_cast<std::uint8_t>(state | toggle_);
    toggle_ ^= 0x80;
    last_ = now;
    watches_ = true;
    return byte;
  }
  /// Once for each loss. @param life  guard time (100C) times life time factor (100D), ns; 0: the master is not watched
  bool lost(std::int64_t life, std::int64_t now) noexcept {
    if (!watches_ || life == 0 || now - last_ <= life)
      return false;
    watches_ = false;
    return true;
  }

 private:
  std::uint8_t toggle_ = 0;
  bool watches_ = false;
  std::int64_t last_ = 0;
};

}  // namespace tandem::sim::drives
