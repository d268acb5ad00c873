// SPDX-License-Identifier: Apache-2.0
/** @file Bounded queue between two threads. */
#pragma once

#include <atomic>
#include <cstddef>
#include <stdexcept>
#include <utility>
#include <vector>

namespace tandem::runtime {

/** First in, first out, from one producer thread to one consumer thread. Wait-free; allocates in its constructor only.
 */
template <class T>
class SpscQueue {
 public:
  /// @throw std::invalid_argument for a capacity of zero.
  explicit SpscQueue(std::size_t capacity) : ring_(capacity + 1) {
    if (capacity == 0) {
      throw std::invalid_argument("a queue needs a capacity of at least one");
    }
  }

  std::size_t capacity() const { return ring_.size() - 1; }

  /// Producer thread only. @return false if the queue is full.
  bool push(const T& value) {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    const std::size_t next = after(tail);
    if (next == head_.load(std::memory_order_acquire)) {
      return false;
    }
    ring_[tail] = value;
    tail_.store(next, std::memory_order_release);
    return true;
  }

  /// Consumer thread only. @return false if the queue is empty.
  bool pop(T& value) {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(std::memory_order_acquire)) {
      return false;
    }
    value = std::move(ring_[head]);
    head_.store(after(head), std::memory_order_release);
    return true;
  }

 private:
  std::size_t after(std::size_t index) const { return index + 1 == ring_.size() ? 0 : index + 1; }

  std::vector<T> ring_;
  alignas(64) std::atomic<std::size_t> head_{0};
  alignas(64) std::atomic<std::size_t> tail_{0};
};

}  // namespace tandem::runtime
