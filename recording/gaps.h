// SPDX-License-Identifier: Apache-2.0
/** @file Counter of lost samples, detected by gaps in the writers' sequence numbers. */
#pragma once

#include <cstdint>
#include <map>

namespace tandem::recording {

/** Counts missing sequence numbers per writer. @tparam Writer  identifies a writer, e.g. channel of a file */
template <class Writer>
class GapCounter {
 public:
  /// Processes the next sample of a writer. Numbers wrap at 2^32; a smaller number than expected is no gap.
  void see(const Writer& writer, std::uint32_t sequence) {
    const auto [known, is_new] = next_.try_emplace(writer, sequence);
    const auto ahead = static_cast<std::int32_t>(sequence - known->second);
    if (ahead < 0)
      return;
    lost_[writer] += static_cast<std::uint32_t>(ahead);
    total_ += static_cast<std::uint32_t>(ahead);
    known->second = sequence + 1;
  }
  std::uint64_t lost() const { return total_; }
  std::uint64_t lost(const Writer& writer) const {
    const auto found = lost_.find(writer);
    return found == lost_.end() ? 0 : found->second;
  }

 private:
  std::map<Writer, std::uint32_t> next_;
  std::map<Writer, std::uint64_t> lost_;
  std::uint64_t total_ = 0;
};

}  // namespace tandem::recording
