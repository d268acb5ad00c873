// SPDX-License-Identifier: Apache-2.0
#include "services/console/client_queue.h"

#include <utility>

namespace tandem::console {
namespace {

/// Memory of a frame, including its queue entry.
std::size_t costOf(const Outgoing& frame) { return frame.payload->size() + 128; }

}  // namespace

void ClientQueue::dropOldest(std::uint32_t channel, Line& line) {
  bytes_ -= costOf(line.frames.front().frame);
  --count_;
  line.frames.pop_front();
  ++dropped_;
  ++dropped_by_channel_[channel];
}

/// Drops the oldest samples of channels that may lose some. @return whether there is room now.
bool ClientQueue::makeRoom(std::size_t size) {
  while (bytes_ + size > kBytes) {
    auto oldest = lines_.end();
    for (auto line = lines_.begin(); line != lines_.end(); ++line) {
      const bool candidate = line->second.may_lose && !line->second.frames.empty();
      if (candidate &&
          (oldest == lines_.end() || line->second.frames.front().number < oldest->second.frames.front().number))
        oldest = line;
    }
    if (oldest == lines_.end())
      return false;
    dropOldest(oldest->first, oldest->second);
  }
  return true;
}

bool ClientQueue::push(std::uint32_t channel, bool may_lose, Outgoing frame) {
  const std::lock_guard lock(mutex_);
  if (overflown_ || sealed_)
    return false;
  const bool was_empty = count_ == 0;
  Line& line = lines_[channel];
  line.may_lose = may_lose;
  if (may_lose && line.frames.size() >= kPerChannel)
    dropOldest(channel, line);
  const std::size_t cost = costOf(frame);
  if (!makeRoom(cost)) {
    overflown_ = true;
    lines_.clear();
    bytes_ = count_ = 0;
    return true;  // the sending thread must be woken
  }
  bytes_ += cost;
  ++count_;
  line.frames.push_back({next_++, std::move(frame)});
  return was_empty;
}

std::optional<Outgoing> ClientQueue::pop() {
  const std::lock_guard lock(mutex_);
  Line* oldest = nullptr;
  for (auto& [channel, line] : lines_) {
    if (!line.frames.empty() && (oldest == nullptr || line.frames.front().number < oldest->frames.front().number))
      oldest = &line;
  }
  if (oldest == nullptr)
    return std::nullopt;
  Outgoing frame = std::move(oldest->frames.front().frame);
  oldest->frames.pop_front();
  bytes_ -= costOf(frame);
  --count_;
  return frame;
}

void ClientQueue::forget(std::uint32_t channel) {
  const std::lock_guard lock(mutex_);
  const auto line = lines_.find(channel);
  if (line == lines_.end())
    return;
  for (const Waiting& waiting : line->second.frames)
    bytes_ -= costOf(waiting.frame);
  count_ -= line->second.frames.size();
  lines_.erase(line);
}

void ClientQueue::seal() {
  const std::lock_guard lock(mutex_);
  sealed_ = true;
}

bool ClientQueue::overflown() const {
  const std::lock_guard lock(mutex_);
  return overflown_;
}

std::uint64_t ClientQueue::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

std::map<std::uint32_t, std::uint64_t> ClientQueue::takeDropped() {
  const std::lock_guard lock(mutex_);
  return std::exchange(dropped_by_channel_, {});
}

}  // namespace tandem::console
