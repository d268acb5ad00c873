// SPDX-License-Identifier: Apache-2.0
/** @file The model's initial value problem for any end angles, stable or not. */
#pragma once

#include "kinematics/concentric_tube.h"

namespace tandem::test {

/// Properties of the equilibrium with the given end angles.
struct EndAngleTrack {
  double minimum = 0.0;      ///< of the determinant
  double determinant = 0.0;  ///< at the motors
  int conjugate_points = 0;
  Eigen::VectorXd motors;  ///< corresponding alpha, rad
};

EndAngleTrack trackOf(const kinematics::ConcentricTubeArm& arm, const Eigen::VectorXd& q, const Eigen::VectorXd& theta);

}  // namespace tandem::test
