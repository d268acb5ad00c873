// SPDX-License-Identifier: Apache-2.0
/** @file Event queue from the periodic cycle to the logging thread. */
#pragma once

#include <array>
#include <cstddef>

namespace tandem::hal {

/** First-in first-out queue for one thread, without heap allocation. A full ring drops its oldest event. */
template <class Event, std::size_t kSize>
class EventRing {
 public:
  void push(const Event& event) noexcept {
    if (count_ == kSize) {
      first_ = (first_ + 1) % kSize;
      --count_;
    }
    events_[(first_ + count_++) % kSize] = event;
  }

  /// @return false: the queue is empty.
  bool pop(Event& event) noexcept {
    if (count_ == 0)
      return false;
    event = events_[first_];
    first_ = (first_ + 1) % kSize;
    --count_;
    return true;
  }

 private:
  std::array<Event, kSize> events_{};
  std::size_t first_ = 0, count_ = 0;
};

}  // namespace tandem::hal
