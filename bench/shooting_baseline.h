// SPDX-License-Identifier: Apache-2.0
/** @file Baseline for the compliant model: textbook shooting solution. */
#pragma once

#include "kinematics/arm_model.h"

namespace tandem::bench {

/** Rucker et al. 2010 by adaptive integration (Boost.odeint, Dormand and Prince, 1e-9), shooting with Newton's method,
 * and differences for every derivative: how public codes of the field do it. Unloaded arms only. */
class ShootingBaseline {
 public:
  explicit ShootingBaseline(const kinematics::ConcentricTubeArm& arm) : arm_(arm) {}

  /// Pose and Jacobian. @param twist_rate u_iz at the entry point, 1/m: guess in, solution out. @return false if the
  /// bounded number of iterations did not suffice.
  bool tip(const Eigen::VectorXd& q, Eigen::VectorXd& twist_rate, kinematics::Tip& tip) const;

 private:
  bool solve(const Eigen::VectorXd& q, Eigen::VectorXd& twist_rate, Eigen::Isometry3d& pose) const;
  Eigen::VectorXd shoot(const Eigen::VectorXd& q, const Eigen::VectorXd& twist_rate, Eigen::Isometry3d& pose) const;

  const kinematics::ConcentricTubeArm& arm_;
};

}  // namespace tandem::bench
