// SPDX-License-Identifier: Apache-2.0
/** @file Ring buffer of serialized samples with a fixed capacity. */
#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::recording {

/** What belongs to the bytes of a sample. Times are ns since the epoch. */
struct SampleTag {
  std::uint32_t topic = 0;  ///< index into the list of whoever fills the ring
  std::uint32_t size = 0;   ///< of the bytes; the ring sets it
  std::uint64_t sequence = 0;
  std::uint64_t log_time = 0;
  std::uint64_t publish_time = 0;
  std::array<std::uint8_t, 16> writer{};
};

/** A ring of samples of any size; the newest ones push out the oldest. Any thread may call anything; nothing waits for
 * more than the copy of one sample. */
class SampleRing {
 public:
  /** A place in the stream of all samples ever put in. */
  struct Place {
    std::uint64_t byte = 0;
    std::uint64_t sample = 0;
  };

  /// @param capacity bytes, for samples and 48 bytes with each; taken, and touched, at once.
  explicit SampleRing(std::size_t capacity);

  /// Puts a sample in. Allocates nothing. @return false where it is larger than the ring.
  bool push(SampleTag tag, std::string_view bytes) noexcept;

  struct Extent {
    Place begin;               ///< of the oldest sample; so many samples have left the ring
    Place end;                 ///< behind the newest one
    std::uint64_t oldest = 0;  ///< log time; 0: empty
  };
  Extent extent() const;

  /// Copies the sample at a place, or the oldest one where that place was overwritten, and moves the place behind it.
  /// @param missed adds how many samples were overwritten in between. @return false at the end.
  bool next(Place& place, SampleTag& tag, std::string& bytes, std::uint64_t& missed) const;

 private:
  void copyIn(std::uint64_t byte, const void* from, std::size_t size) noexcept;
  void copyOut(std::uint64_t byte, void* to, std::size_t size) const noexcept;

  mutable std::mutex mutex_;
  std::vector<char> memory_;
  Place begin_, end_;
};

}  // namespace tandem::recording
