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

enum class FrameKind { kSample, kText, kBinary };

/** One frame to a client. */
struct Outgoing {
  FrameKind kind = FrameKind::kSample;
  MessageHeader header{};                      ///< of a sample, before the payload
  std::shared_ptr<const std::string> payload;  ///< shared among clients
};

/** Queue of all channels' frames in the order of arrival. Any thread.
 *
 * In a channel that may lose samples, the newest sample replaces the oldest. Other frames accumulate until the queue
 * overflows; the client is then disconnected, so that it does not miss an answer unnoticed. */
class ClientQueue {
 public:
  static constexpr std::size_t kPerChannel = 64;          ///< samples of a channel that may lose some
  static constexpr std::size_t kBytes = 8 * 1024 * 1024;  ///< of all frames in the queue

  /// Adds a frame. @param channel  any number; kText for text frames @param may_lose  whether the oldest may be dropped
  /// @return whether the queue was empty before: a thread must be woken.
  bool push(std::uint32_t channel, bool may_lose, Outgoing frame);
  static constexpr std::uint32_t kText = 0xffffffff;

  /// The oldest frame; empty if the queue is empty.
  std::optional<Outgoing> pop();
  /// Removes the frames of a channel, after its subscription has ended.
  void forget(std::uint32_t channel);

  /// Accepts no further frames.
  void seal();
  /// Whether the queue has exceeded its limit: it accepts no further frames.
  bool overflown() const;
  /// Samples dropped so far.
  std::uint64_t dropped() const;
  /// Samples dropped since the last call, by channel.
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
  bool overflown_ = false, sealed_ = false;
};

}  // namespace tandem::console
