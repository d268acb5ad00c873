// SPDX-License-Identifier: Apache-2.0
/** @file Blocking queue between threads outside the periodic path. Not for the periodic path: it locks and
 * allocates. */
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>
#include <variant>

#include "services/runtime/process.h"

namespace tandem::runtime {

/** Messages from DDS threads to a worker thread, in order. Any thread may call put() and take(). */
template <class T>
class Mailbox {
 public:
  void put(T message) {
    {
      const std::lock_guard lock(mutex_);
      queue_.push_back(std::move(message));
    }
    arrived_.notify_one();
  }

  /// The next message, waiting up to `seconds` for it.
  std::optional<T> take(double seconds) {
    std::unique_lock lock(mutex_);
    arrived_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return !queue_.empty(); });
    if (queue_.empty())
      return std::nullopt;
    T message = std::move(queue_.front());
    queue_.pop_front();
    return message;
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<T> queue_;
};

/** Event loop of a service, as in lock-step, where messages advance the time: one thread handles messages from DDS
 * threads in the order of arrival. */
template <class... Messages>
class EventLoop {
 public:
  /// From any thread.
  template <class Message>
  void put(Message message) {
    mailbox_.put(std::move(message));
  }

  /// Runs until a stop is requested: calls `handle` with each message, and with std::monostate if none was received for
  /// `timeout` s; sends a heartbeat before each call.
  template <class Handle>
  void run(const Setup& setup, const StopSignal& stop, double timeout, Handle handle) {
    while (!stop.requested()) {
      Event event = mailbox_.take(timeout).value_or(Event{});
      setup.heartbeat->beat();
      std::visit(handle, std::move(event));
    }
  }

 private:
  using Event = std::variant<std::monostate, Messages...>;
  Mailbox<Event> mailbox_;
};

}  // namespace tandem::runtime
