// SPDX-License-Identifier: Apache-2.0
#include "hal/measured_motion.h"

#include <algorithm>
#include <cmath>

#include "safety/limits.h"

namespace tandem::hal {

MeasuredMotion::MeasuredMotion(double fastest, double resolution, double period) noexcept
    : fastest_(fastest), resolution_(resolution), period_(period) {}

void MeasuredMotion::restart() noexcept {
  begun_ = false;
  velocity_ = 0.0;
  standing_ = fast_ = 0;
}

void MeasuredMotion::sample(double position, std::int64_t time) noexcept {
  constexpr double kStandstill = 0.02;  // of the maximum speed
  constexpr double kHair = 1.0 + 1e-9;  // tolerance for rounding: positions are multiples of the resolution
  const double step = position - position_;
  const double passed = std::max(period_, 1e-9 * static_cast<double>(time - time_));
  const bool first = !begun_;
  position_ = position;
  time_ = time;
  begun_ = true;
  if (first)
    return;
  velocity_ = std::abs(step) <= kHair * resolution_ ? 0.0 : step / passed;
  const bool rest = std::abs(step) <= 2.0 * kHair * resolution_ || std::abs(velocity_) <= kStandstill * fastest_;
  const bool fast = std::abs(velocity_) > safety::kOverspeedFactor * fastest_ + 2.0 * resolution_ / passed;
  standing_ = rest ? std::min(standing_ + 1, kSamples) : 0;
  fast_ = fast ? std::min(fast_ + 1, kSamples) : 0;
}

}  // namespace tandem::hal
