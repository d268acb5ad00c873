// SPDX-License-Identifier: Apache-2.0
/** @file Independent solver of the tube boundary value problem, with and without tip wrench. */
#pragma once

#include <Eigen/Geometry>

#include "kinematics/concentric_tube.h"

namespace tandem::test {

/** Shooting from the motors' side in the frame of tube 1, with the model as written by Rucker et al. 2010; shares
 * only the tubes' data with kinematics/. Boost.odeint integrates from boundary to boundary with a tolerance of
 * 1e-13, Newton's method with finite differences solves the boundary conditions. */
class BoundaryValueOracle {
 public:
  struct Solution {
    bool converged = false;
    Eigen::Isometry3d tip;      ///< robot base frame <- tool tip frame
    Eigen::VectorXd end_angle;  ///< of each tube in the torsion-free frame, rad
    Eigen::VectorXd moment;     ///< torsional, in each tube at the entry point, N m
    double residual = 0.0;      ///< largest remaining value: twist rate at an end, 1/m; position of the tip, m
  };

  explicit BoundaryValueOracle(const kinematics::ConcentricTubeArm& arm) : arm_(arm) {}

  /// @param guess of Solution::moment
  /// @param wrench force and moment at the tool tip, robot base frame
  /// @param tool_tip guess of its position, robot base frame; unused without a force
  Solution solve(const Eigen::VectorXd& q,
                 const Eigen::VectorXd& guess,
                 const Eigen::Matrix<double, 6, 1>& wrench = Eigen::Matrix<double, 6, 1>::Zero(),
                 const Eigen::Vector3d& tool_tip = Eigen::Vector3d::Zero()) const;

 private:
  struct Shot {
    Eigen::VectorXd residual;
    Solution solution;
  };
  Shot shoot(const Eigen::VectorXd& q, const Eigen::VectorXd& unknown, const Eigen::Matrix<double, 6, 1>& wrench) const;

  const kinematics::ConcentricTubeArm& arm_;
};

}  // namespace tandem::test
