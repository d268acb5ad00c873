// SPDX-License-Identifier: Apache-2.0
/** @file The One-Euro filter: little jitter at standstill, little lag in motion (Casiez, Roussel, Vogel, CHI 2012). */
#pragma once

#include <Eigen/Core>

namespace tandem::planning::teleoperation {

/** Parameters of the filter. */
struct OneEuroOptions {
  double min_cutoff = 2.0;         ///< f_c at standstill, Hz
  double beta = 200.0;             ///< increase of f_c with speed: Hz per m/s, that is 1/m
  double derivative_cutoff = 1.0;  ///< of the low-pass filter of the speed, Hz
};

/** First-order low-pass of a position whose cutoff grows with its speed: f_c = f_min + beta |x'|. All three coordinates
 * share one cutoff, so that a straight line stays straight. */
class OneEuro {
 public:
  explicit OneEuro(const OneEuroOptions& options) : options_(options) {}

  /// Resets the filter to position x, m, with zero speed.
  void reset(const Eigen::Vector3d& x) noexcept;
  /// Next sample, m, `dt` seconds after the previous one. @return the filtered position.
  const Eigen::Vector3d& step(const Eigen::Vector3d& x, double dt) noexcept;
  /// Shifts input and output by the same vector, without a transient.
  void shift(const Eigen::Vector3d& by) noexcept;
  const Eigen::Vector3d& value() const noexcept { return value_; }

 private:
  OneEuroOptions options_;
  Eigen::Vector3d last_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d value_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d speed_ = Eigen::Vector3d::Zero();
};

}  // namespace tandem::planning::teleoperation
