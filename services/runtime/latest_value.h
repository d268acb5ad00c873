// SPDX-License-Identifier: Apache-2.0
/** @file Wait-free hand-over of the latest value between two threads. */
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace tandem::runtime {

/** One writer stores values, one reader takes the latest; values in between are dropped by design. Wait-free on both
 * sides (triple buffer: each side owns one slot and swaps it with the third). No allocation, no torn values. */
template <class T>
class LatestValue {
  static_assert(std::is_trivially_copyable_v<T>, "a slot is copied as bytes; hand over a plain struct");

 public:
  /// Writer thread only.
  void store(const T& value) noexcept {
    slots_[write_].value = value;
    write_ = shared_.exchange(static_cast<std::uint8_t>(write_ | kFresh), std::memory_order_acq_rel) & kIndex;
  }

  /// Reader thread only. Copies the latest value if not taken before.
  /// @return whether a new value was stored; otherwise `value` is unchanged.
  bool take(T& value) noexcept {
    if ((shared_.load(std::memory_order_relaxed) & kFresh) == 0) {
      return false;
    }
    read_ = shared_.exchange(read_, std::memory_order_acq_rel) & kIndex;
    value = slots_[read_].value;
    return true;
  }

 private:
  static constexpr std::uint8_t kFresh = 4;
  static constexpr std::uint8_t kIndex = 3;

  struct alignas(64) Slot {
    T value{};
  };
  std::array<Slot, 3> slots_{};
  alignas(64) std::atomic<std::uint8_t> shared_{0};
  alignas(64) std::uint8_t write_ = 1;
  alignas(64) std::uint8_t read_ = 2;
};

/** The same for a stream whose losses are counted: each value is transferred with the number of values stored so far,
 * this one included. */
template <class T>
class LatestSample {
 public:
  /// Writer thread only.
  void store(const T& value) noexcept {
    written_.value = value;
    ++written_.arrivals;
    latest_.store(written_);
  }
  /// Reader thread only; as LatestValue::take().
  bool take() noexcept { return latest_.take(read_); }
  /// Last value taken.
  const T& value() const noexcept { return read_.value; }
  std::uint64_t arrivals() const noexcept { return read_.arrivals; }

 private:
  struct Counted {
    T value{};
    std::uint64_t arrivals = 0;
  };
  LatestValue<Counted> latest_;
  Counted written_, read_;
};

}  // namespace tandem::runtime
