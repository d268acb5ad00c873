// SPDX-License-Identifier: Apache-2.0
/** @file Outbox: non-blocking hand-over of messages from the periodic thread to a publishing thread. */
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "services/runtime/latest_value.h"
#include "services/runtime/spsc_queue.h"

namespace tandem::runtime {

/** Publisher thread with lock-free input channels.
 *
 * Channels are opened before start(). Each channel has one posting thread (different channels may have different ones);
 * posting neither allocates nor locks, and wakes the publisher thread with one write to an eventfd. Typical use:
 *
 *     Outbox outbox;
 *     auto& state = outbox.latest<dds::ActuationState>([&](const auto& message) { writer.write(message); });
 *     outbox.start();
 *     ... state.post(message) in the loop ...
 *
 * Messages that contain texts or lists are built inside the send function, from a plain struct.
 */
class Outbox {
  class Channel {
   public:
    virtual ~Channel() = default;
    virtual void drain() = 0;
  };

 public:
  /** Sends the latest value; values replaced before the publisher thread reads them are not sent. */
  template <class T>
  class Latest final : public Channel {
   public:
    Latest(Outbox& outbox, std::function<void(const T&)> send) : outbox_(outbox), send_(std::move(send)) {}
    void post(const T& value) noexcept {
      slot_.store(value);
      outbox_.wake();
    }

   private:
    void drain() override {
      if (slot_.take(scratch_)) {
        send_(scratch_);
      }
    }
    Outbox& outbox_;
    std::function<void(const T&)> send_;
    LatestValue<T> slot_;
    T scratch_{};
  };

  /** Sends every value in order, up to a capacity; for lock-step, replies and log lines. */
  template <class T>
  class Queue final : public Channel {
    static_assert(std::is_trivially_copyable_v<T>, "a queue on the periodic path holds plain structs");

   public:
    Queue(Outbox& outbox, std::size_t capacity, std::function<void(const T&)> send)
        : outbox_(outbox), send_(std::move(send)), queue_(capacity) {}
    /// @return false if the queue is full; the value is dropped and counted.
    bool post(const T& value) noexcept {
      const bool pushed = queue_.push(value);
      if (!pushed) {
        dropped_.fetch_add(1, std::memory_order_relaxed);
      }
      outbox_.wake();
      return pushed;
    }
    std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

   private:
    void drain() override {
      // At most one pass over the ring, so that a busy channel cannot starve the others.
      for (std::size_t i = 0; i < queue_.capacity() && queue_.pop(scratch_); ++i) {
        send_(scratch_);
      }
    }
    Outbox& outbox_;
    std::function<void(const T&)> send_;
    SpscQueue<T> queue_;
    std::atomic<std::uint64_t> dropped_{0};
    T scratch_{};
  };

  /// @throw std::system_error if the kernel grants no eventfd.
  Outbox();
  /// As stop().
  ~Outbox();
  Outbox(const Outbox&) = delete;
  Outbox& operator=(const Outbox&) = delete;

  /// Opens a channel that lives as long as the outbox. `send` runs on the publisher thread and must not throw.
  /// @throw std::logic_error after start().
  template <class T>
  Latest<T>& latest(std::function<void(const T&)> send) {
    return add(std::make_unique<Latest<T>>(*this, std::move(send)));
  }
  /// As latest(), for a queue.
  template <class T>
  Queue<T>& queue(std::size_t capacity, std::function<void(const T&)> send) {
    return add(std::make_unique<Queue<T>>(*this, capacity, std::move(send)));
  }

  /// Starts the publisher thread. It inherits the scheduling of the caller: call it before enterRealtime().
  void start();
  /// Sends all posted values and ends the thread. Idempotent.
  void stop();

 private:
  template <class C>
  C& add(std::unique_ptr<C> channel) {
    if (thread_.joinable()) {
      throw std::logic_error("channels of an outbox are opened before it starts");
    }
    C& result = *channel;
    channels_.push_back(std::move(channel));
    return result;
  }
  void wake() noexcept;
  void run();

  int event_ = -1;
  std::atomic<bool> stop_{false};
  std::vector<std::unique_ptr<Channel>> channels_;
  std::thread thread_;
};

}  // namespace tandem::runtime
