// SPDX-License-Identifier: Apache-2.0
/** @file Statistics of the errors of one task over a run. */
#pragma once

#include <array>
#include <cstdint>

namespace tandem::planning {

/** RMS, maximum and percentiles of errors that are added one by one. Memory is constant: errors are counted in
 * intervals whose bounds grow by kRatio from kFinest on. */
class ErrorStatistics {
 public:
  static constexpr double kFinest = 1e-9;  ///< m: smaller errors are counted in the first interval
  static constexpr double kRatio = 1.01;

  void add(double error) noexcept;  ///< @param error  m, not negative
  std::uint64_t count() const noexcept { return count_; }
  double rms() const noexcept;  ///< m; 0 without errors
  double maximum() const noexcept { return maximum_; }
  /// The least error that `fraction` (0 to 1) of all errors do not exceed, m; up to 1 % too large, never above
  /// maximum(). 0 without errors.
  double percentile(double fraction) const noexcept;

 private:
  static constexpr std::size_t kIntervals = 2100;  // up to 1.2 m; larger errors are counted in the last one

  std::array<std::uint32_t, kIntervals> counts_{};
  std::uint64_t count_ = 0;
  double squares_ = 0.0, maximum_ = 0.0;
};

}  // namespace tandem::planning
