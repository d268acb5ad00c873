// SPDX-License-Identifier: Apache-2.0
/** @file Bounded send queue of one client. */
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "services/console/protocol.h"

namespace tandem::console {

/** One frame to a client. */
struct Outgoing {
  bool text = false;                           ///< a text frame: the header does not count
  MessageHeader header{};                      ///< in front of the payload
  std::shared_ptr<const std::string> payload;  ///< shared among clients
};

/** Frames in the order in which they came, of all channels together. Any thread.
 *
 * Of a channel that may lose samples the oldest gives way to the newest one. What may not be lost piles up until the
 * queue overflows: then the client has to go, rather than miss an answer without knowing. */
class ClientQueue {
 public:
  static constexpr std::size_t kPerChannel = 64;          ///< samples of a channel that may lose some
  static constexpr std::size_t kBytes = 8 * 1024 * 1024;  ///< of all that waits

  /// Adds a frame. @param channel  any number; text frames have kText @param may_lose  whether the oldest may give way
  /// @return whether the queue was empty before: a thread has to be woken.
  bool push(std::uint32_t channel, bool may_lose, Outgoing frame);
  static constexpr std::uint32_t kText = 0xffffffff;

  /// The oldest frame; nothing where the queue is empty.
  std::optional<Outgoing> pop();
  /// Leaves out what waits of a channel, as nobody wants it any more.
  void forget(std::uint32_t channel);

  /// More waits than may: nothing is taken any more.
  bool overflown() const;
  /// Samples that gave way so far.
  std::uint64_t dropped() const;
  /// Samples that gave way since the last call, by channel.
  std::map<std::uint32_t, std::uint64_t> takeDropped();

 private:
  struct Waiting {
    std::uint64_t number;
    Outgoing frame;
  };
  struct Line {
    bool may_lose = true;
    std::deque<Waiting> frames;
  };

  void dropOldest(std::uint32_t channel, Line& line);
  bool makeRoom(std::size_t size);

  mutable std::mutex mutex_;
  std::map<std::uint32_t, Line> lines_;
  std::map<std::uint32_t, std::uint64_t> dropped_by_channel_;
  std::uint64_t next_ = 0, dropped_ = 0;
  std::size_t bytes_ = 0, count_ = 0;
  bool overflown_ = false;
};

}  // namespace tandem::console
