// SPDX-License-Identifier: Apache-2.0
/** @file Baseline for the compliant model: textbook shooting solution. */
#pragma once

#include "kinematics/arm_model.h"

namespace tandem::bench {

/** Model of Rucker et al. 2010 with adaptive integration (Boost.odeint, Dormand and Prince, 1e-9), Newton shooting,
 * and finite differences for every derivative, like public codes of the field. Unloaded arms only. */
class ShootingBaseline {
 public:
  explicit ShootingBaseline(const kinematics::ConcentricTubeArm& arm) : arm_(arm) {}

  /// Pose and Jacobian. @param twist_rate u_iz at the entry point, 1/m: initial guess in, solution out. @return false
  /// if the maximum number of iterations is reached.
  bool tip(const Eigen::VectorXd& q, Eigen::VectorXd& twist_rate, kinematics::Tip& tip) const;

 private:
  bool solve(const Eigen::VectorXd& q, Eigen::VectorXd& twist_rate, Eigen::Isometry3d& pose) const;
  Eigen::VectorXd shoot(const Eigen::VectorXd& q, const Eigen::VectorXd& twist_rate, Eigen::Isometry3d& pose) const;

  const kinematics::ConcentricTubeArm& arm_;
};

}  // namespace tandem::bench
