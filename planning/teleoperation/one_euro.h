// SPDX-License-Identifier: Apache-2.0
/** @file The One-Euro filter: little jitter at standstill, little lag in motion (Casiez, Roussel, Vogel, CHI 2012). */
#pragma once

#include <Eigen/Core>
#include <numbers>

#include "planning/teleoperation/spaces.h"

namespace tandem::planning::teleoperation {

/** Parameters of the filter. */
struct OneEuroOptions {
  double min_cutoff = 2.0;         ///< f_c at standstill, Hz
  double beta = 200.0;             ///< increase of f_c with speed: Hz per m/s, that is 1/m; of orientations 1/rad
  double derivative_cutoff = 1.0;  ///< of the low-pass filter of the speed, Hz
};

/** First-order low-pass of a position or an orientation whose cutoff grows with its speed: f_c = f_min + beta |x'|. All
 * three coordinates share one cutoff, so that a straight line stays straight. */
template <class Space>
class OneEuro {
 public:
  using Point = typename Space::Point;

  explicit OneEuro(const OneEuroOptions& options, const Space& space = {}) : options_(options), space_(space) {}

  /// Resets the filter to x with zero speed.
  void reset(const Point& x) noexcept {
    last_ = value_ = x;
    speed_.setZero();
  }
  /// Next sample, `dt` seconds after the previous one. @return the filtered one.
  const Point& step(const Point& x, double dt) noexcept {
    speed_ += share(options_.derivative_cutoff, dt) * (space_.difference(x, last_) / dt - speed_);
    last_ = x;
    const double cutoff = options_.min_cutoff + options_.beta * speed_.norm();
    value_ = space_.moved(value_, share(cutoff, dt) * space_.difference(x, value_));
    return value_;
  }
  /// Shifts input and output by the same difference, without a transient.
  void shift(const Eigen::Vector3d& by) noexcept {
    last_ = space_.moved(last_, by);
    value_ = space_.moved(value_, by);
  }
  const Point& value() const noexcept { return value_; }

 private:
  /// Weight of a new sample at this cutoff: alpha = 1 / (1 + tau / T), tau = 1 / (2 pi f_c).
  static double share(double cutoff, double dt) noexcept {
    return 1.0 / (1.0 + 1.0 / (2.0 * std::numbers::pi * cutoff * dt));
  }

  OneEuroOptions options_;
  Space space_;
  Point last_ = Space::origin();
  Point value_ = Space::origin();
  Eigen::Vector3d speed_ = Eigen::Vector3d::Zero();
};

}  // namespace tandem::planning::teleoperation
