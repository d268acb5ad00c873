// SPDX-License-Identifier: Apache-2.0
#include "planning/error_statistics.h"

#include <algorithm>
#include <cmath>

namespace tandem::planning {

void ErrorStatistics::add(double error) noexcept {
  const double place = error > kFinest ? std::ceil(std::log(error / kFinest) / std::log(kRatio)) : 0.0;
  ++counts_[static_cast<std::size_t>(std::min(place, static_cast<double>(kIntervals - 1)))];
  ++count_;
  squares_ += error * error;
  maximum_ = std::max(maximum_, error);
}

double ErrorStatistics::rms() const noexcept {
  return count_ > 0 ? std::sqrt(squares_ / static_cast<double>(count_)) : 0.0;
}

double ErrorStatistics::percentile(double fraction) const noexcept {
  std::uint64_t left = static_cast<std::uint64_t>(std::ceil(fraction * static_cast<double>(count_)));
  for (std::size_t k = 0; k + 1 < kIntervals && left > 0; ++k) {
    if (counts_[k] >= left)
      return std::min(maximum_, kFinest * std::pow(kRatio, static_cast<double>(k)));
    left -= counts_[k];
  }
  return maximum_;
}

}  // namespace tandem::planning
