// SPDX-License-Identifier: Apache-2.0
/** @file The model's initial value problem at any angles of the ends, stable or not. */
#pragma once

#include "kinematics/concentric_tube.h"

namespace tandem::test {

/// What the model says about the equilibrium that ends at given angles.
struct EndAngleTrack {
  double minimum = 0.0;      ///< of the determinant
  double determinant = 0.0;  ///< at the motors
  int conjugate_points = 0;
  Eigen::VectorXd motors;  ///< alpha that it needs, rad
};

EndAngleTrack trackOf(const kinematics::ConcentricTubeArm& arm, const Eigen::VectorXd& q, const Eigen::VectorXd& theta);

}  // namespace tandem::test
