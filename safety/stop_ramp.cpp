// SPDX-License-Identifier: Apache-2.0
#include "safety/stop_ramp.h"

#include <algorithm>
#include <cmath>

namespace tandem::safety {
namespace {

/// Longest time t for which `value + rate t` stays below a bound; values beyond the bound may not grow.
double timeToBound(double value, double rate, double bound) noexcept {
  if (!(rate > 0.0))
    return kUnlimited;
  return std::max(0.0, bound - value) / rate;
}

/// Longest time for which the line q + v t stays inside the limits, s.
double timeInside(const ArmLimits& limits, const ArmVector& q, const ArmVector& v) noexcept {
  double time = kUnlimited;
  for (int j = 0; j < limits.jointCount(); ++j) {
    time = std::min(time, timeToBound(q[j], v[j], limits.joints[j].upper));
    time = std::min(time, timeToBound(-q[j], -v[j], -limits.joints[j].lower));
  }
  for (const LinearRow& row : limits.rows) {
    time = std::min(time, timeToBound(rowValue(row, q), rowValue(row, v), row.b));
  }
  return time;
}

bool noFartherOut(const ArmLimits& limits, const ArmVector& from, const ArmVector& to) noexcept {
  for (int j = 0; j < limits.jointCount(); ++j) {
    if (to[j] > std::max(limits.joints[j].upper, from[j]) || to[j] < std::min(limits.joints[j].lower, from[j])) {
      return false;
    }
  }
  for (const LinearRow& row : limits.rows) {
    if (rowValue(row, to) > std::max(row.b, rowValue(row, from)))
      return false;
  }
  return true;
}

}  // namespace

void StopRamp::start(const ArmLimits& limits, const ArmVector& q, const ArmVector& v) noexcept {
  start_ = q;
  velocity_ = v;
  elapsed_ = 0.0;
  duration_ = 0.0;
  for (int j = 0; j < limits.jointCount(); ++j) {
    duration_ = std::max(duration_, std::abs(v[j]) / limits.joints[j].stop_deceleration);
  }
  // At constant deceleration the line is as long as at full speed for half the time.
  duration_ = std::min(duration_, 2.0 * timeInside(limits, q, v));
  end_ = q + 0.5 * duration_ * v;
  // Rounding may put the end outside by one last bit.
  for (int attempt = 0; !noFartherOut(limits, q, end_) && attempt < 8; ++attempt) {
    duration_ *= 1.0 - 1e-14 * std::pow(10.0, attempt);
    end_ = q + 0.5 * duration_ * v;
  }
  if (duration_ > 0.0 && noFartherOut(limits, q, end_))
    return;
  duration_ = 0.0;
  end_ = q;
}

void StopRamp::step(double dt, ArmVector& q, ArmVector& v) noexcept {
  elapsed_ += dt;
  if (standing()) {
    elapsed_ = duration_;
    q = end_;
    v.setZero(end_.size());
    return;
  }
  const double part = elapsed_ / duration_;
  q = start_ + (elapsed_ * (1.0 - 0.5 * part)) * velocity_;
  v = (1.0 - part) * velocity_;
}

double StopRamp::stoppingDistance(int joint) const noexcept { return std::abs(end_[joint] - start_[joint]); }

}  // namespace tandem::safety
