// SPDX-License-Identifier: Apache-2.0
/** @file Ring buffer of serialized samples with a fixed capacity. */
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

namespace tandem::recording {

/** Metadata of a sample. Times are ns since the epoch. */
struct SampleTag {
  std::uint32_t topic = 0;  ///< index into the caller's list of topics
  std::uint32_t size = 0;   ///< bytes of the sample; set by the ring
  std::uint64_t sequence = 0;
  std::uint64_t log_time = 0;
  std::uint64_t publish_time = 0;
  std::array<std::uint8_t, 16> writer{};
};

/** Ring of samples of any size; new samples overwrite the oldest ones. Thread-safe; no call waits longer than for the
 * copy of one sample. */
class SampleRing {
 public:
  /** Position in the stream of all samples since the construction. */
  struct Place {
    std::uint64_t byte = 0;
    std::uint64_t sample = 0;
  };

  enum class Memory {
    kTouched,  ///< written at once
    kOnDemand  ///< the system provides it where samples come to lie
  };
  /// @param capacity bytes, for samples with 48 bytes of metadata each
  explicit SampleRing(std::size_t capacity, Memory memory = Memory::kTouched);

  /// Stores a sample. Allocates nothing. @return false if it is larger than the ring.
  bool push(SampleTag tag, std::string_view bytes) noexcept;

  struct Extent {
    Place begin;               ///< of the oldest sample; begin.sample samples were overwritten
    Place end;                 ///< after the newest sample
    std::uint64_t oldest = 0;  ///< log time of the oldest sample; 0: empty
  };
  Extent extent() const;

  /// Copies the sample at `place`, or the oldest one if that was overwritten, and moves `place` behind it.
  /// @param missed increased by the number of samples overwritten in between. @return false at the end.
  bool next(Place& place, SampleTag& tag, std::string& bytes, std::uint64_t& missed) const;

  /// For the only reader of a ring: if no sample follows `read`, the next one goes to the beginning of the memory, so
  /// that a reader that keeps up needs a small part of it.
  void rewind(const Place& read) noexcept;

 private:
  void copyIn(std::uint64_t byte, const void* from, std::size_t size) noexcept;
  void copyOut(std::uint64_t byte, void* to, std::size_t size) const noexcept;

  mutable std::mutex mutex_;
  std::size_t capacity_;
  std::unique_ptr<char[]> memory_;
  Place begin_, end_;
};

}  // namespace tandem::recording
