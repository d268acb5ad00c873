// SPDX-License-Identifier: Apache-2.0
#include "recording/sample_ring.h"

#include <algorithm>
#include <cstring>

namespace tandem::recording {

SampleRing::SampleRing(std::size_t capacity, Memory memory)
    : capacity_(std::max(capacity, sizeof(SampleTag) + 1)), memory_(std::make_unique_for_overwrite<char[]>(capacity_)) {
  if (memory == Memory::kTouched)
    std::memset(memory_.get(), 0, capacity_);
}

void SampleRing::copyIn(std::uint64_t byte, const void* from, std::size_t size) noexcept {
  const std::size_t at = byte % capacity_, first = std::min(size, capacity_ - at);
  std::memcpy(memory_.get() + at, from, first);
  std::memcpy(memory_.get(), static_cast<const char*>(from) + first, size - first);
}

void SampleRing::copyOut(std::uint64_t byte, void* to, std::size_t size) const noexcept {
  const std::size_t at = byte % capacity_, first = std::min(size, capacity_ - at);
  std::memcpy(to, memory_.get() + at, first);
  std::memcpy(static_cast<char*>(to) + first, memory_.get(), size - first);
}

bool SampleRing::push(SampleTag tag, std::string_view bytes) noexcept {
  const std::size_t needed = sizeof tag + bytes.size();
  if (needed > capacity_)
    return false;
  tag.size = static_cast<std::uint32_t>(bytes.size());
  const std::lock_guard lock(mutex_);
  while (end_.byte + needed - begin_.byte > capacity_) {
    SampleTag oldest;
    copyOut(begin_.byte, &oldest, sizeof oldest);
    begin_.byte += sizeof oldest + oldest.size;
    ++begin_.sample;
  }
  copyIn(end_.byte, &tag, sizeof tag);
  copyIn(end_.byte + sizeof tag, bytes.data(), bytes.size());
  end_.byte += needed;
  ++end_.sample;
  return true;
}

SampleRing::Extent SampleRing::extent() const {
  const std::lock_guard lock(mutex_);
  Extent extent{begin_, end_, 0};
  if (begin_.byte != end_.byte) {
    SampleTag oldest;
    copyOut(begin_.byte, &oldest, sizeof oldest);
    extent.oldest = oldest.log_time;
  }
  return extent;
}

bool SampleRing::next(Place& place, SampleTag& tag, std::string& bytes, std::uint64_t& missed) const {
  const std::lock_guard lock(mutex_);
  if (place.byte < begin_.byte) {
    missed += begin_.sample - place.sample;
    place = begin_;
  }
  if (place.byte >= end_.byte)
    return false;
  copyOut(place.byte, &tag, sizeof tag);
  bytes.resize(tag.size);
  copyOut(place.byte + sizeof tag, bytes.data(), tag.size);
  place.byte += sizeof tag + tag.size;
  ++place.sample;
  return true;
}

void SampleRing::rewind(const Place& read) noexcept {
  const std::lock_guard lock(mutex_);
  if (read.byte < end_.byte)
    return;
  end_.byte += (capacity_ - end_.byte % capacity_) % capacity_;
  begin_ = end_;
}

}  // namespace tandem::recording
