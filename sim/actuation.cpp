// SPDX-License-Identifier: Apache-2.0
#include "sim/actuation.h"

#include <algorithm>
#include <cmath>

namespace tandem::sim {
namespace {

using safety::ArmVector;

/// Residual below which a lag counts as finished, m or rad.
constexpr double kArrived = 1e-12;

std::int64_t nanoseconds(double seconds) { return std::llround(1e9 * seconds); }

}  // namespace

double lagged(double y, double u0, double u1, double dt, double tau) noexcept {
  if (tau <= 0.0)
    return u1;
  const double behind = tau * (u1 - u0) / dt;  // steady-state lag behind this ramp
  const double next = u1 - behind + (y - u0 + behind) * std::exp(-dt / tau);
  return u0 == u1 && std::abs(next - u1) < kArrived ? u1 : next;
}

double withBacklash(double tube, double motor, double width) noexcept {
  return std::clamp(tube, motor - 0.5 * width, motor + 0.5 * width);
}

double quantised(double x, double resolution) noexcept {
  return resolution > 0.0 ? resolution * std::round(x / resolution) : x;
}

Actuation::Actuation(const JointMechanics& mechanics, const safety::JointKinds& kinds, double shortest_step)
    : mechanics_(mechanics), kinds_(kinds), delay_(nanoseconds(mechanics.delay)) {
  // The newest segment, the oldest one that is partly out, and one for the time before the first step.
  line_.resize(delay_ > 0 ? static_cast<std::size_t>(delay_ / nanoseconds(shortest_step)) + 3 : 0);
}

void Actuation::place(const ArmVector& position) noexcept {
  output_ = delayed_ = position;
  first_ = count_ = 0;
  if (delay_ > 0)
    push(delay_, position);
}

void Actuation::place(int joint, double position) noexcept {
  output_[joint] = delayed_[joint] = position;
  for (std::size_t i = 0; i < count_; ++i)
    at(i).end[joint] = position;
}

void Actuation::push(std::int64_t duration, const ArmVector& end) noexcept {
  if (count_ == line_.size()) {  // steps shorter than shortest_step: merges the two newest
    at(count_ - 1).left += duration;
    at(count_ - 1).end = end;
    return;
  }
  at(count_) = {duration, end};
  ++count_;
}

void Actuation::lag(const ArmVector& to, double dt) noexcept {
  const int n = static_cast<int>(to.size());
  for (int j = 0; j < n; ++j)
    output_[j] = lagged(output_[j], delayed_[j], to[j], dt, mechanics_.lag.of(kinds_[j]));
  delayed_ = to;
}

void Actuation::step(double dt, const ArmVector& reference) noexcept {
  if (delay_ == 0) {
    lag(reference, dt);
    return;
  }
  std::int64_t duration = nanoseconds(dt);
  push(duration, reference);
  while (duration > 0 && count_ > 0) {
    Segment& oldest = at(0);
    const std::int64_t part = std::min(oldest.left, duration);
    const bool whole = part == oldest.left;
    const double share = static_cast<double>(part) / static_cast<double>(oldest.left);
    const ArmVector to = whole ? oldest.end : ArmVector(delayed_ + share * (oldest.end - delayed_));
    lag(to, 1e-9 * static_cast<double>(part));
    oldest.left -= part;
    duration -= part;
    if (whole) {
      first_ = (first_ + 1) % line_.size();
      --count_;
    }
  }
}

bool Actuation::atStandstill() const noexcept {
  for (std::size_t i = 0; i < count_; ++i) {
    if (at(i).end != output_)
      return false;
  }
  return delayed_ == output_;
}

}  // namespace tandem::sim
