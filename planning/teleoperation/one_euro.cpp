// SPDX-License-Identifier: Apache-2.0
#include "planning/teleoperation/one_euro.h"

#include <numbers>

namespace tandem::planning::teleoperation {
namespace {

/// Weight of a new sample at this cutoff: alpha = 1 / (1 + tau / T), tau = 1 / (2 pi f_c).
double share(double cutoff, double dt) noexcept { return 1.0 / (1.0 + 1.0 / (2.0 * std::numbers::pi * cutoff * dt)); }

}  // namespace

void OneEuro::reset(const Eigen::Vector3d& x) noexcept {
  last_ = value_ = x;
  speed_.setZero();
}

void OneEuro::shift(const Eigen::Vector3d& by) noexcept {
  last_ += by;
  value_ += by;
}

const Eigen::Vector3d& OneEuro::step(const Eigen::Vector3d& x, double dt) noexcept {
  speed_ += share(options_.derivative_cutoff, dt) * ((x - last_) / dt - speed_);
  last_ = x;
  value_ += share(options_.min_cutoff + options_.beta * speed_.norm(), dt) * (x - value_);
  return value_;
}

}  // namespace tandem::planning::teleoperation
