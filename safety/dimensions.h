// SPDX-License-Identifier: Apache-2.0
/** @file Fixed capacities shared by all libraries, so that nothing on the periodic path allocates. */
#pragma once

#include <Eigen/Core>

namespace tandem::safety {

/// Most arms that one robot can have.
inline constexpr int kMaxArms = 8;
/// Most joints that one arm can have (four concentric tubes: four translations, four rotations).
inline constexpr int kMaxJointsPerArm = 8;
/// Most joints of a whole robot.
inline constexpr int kMaxJoints = kMaxArms * kMaxJointsPerArm;

/// Joint vector of one arm, stored without heap: [beta_1..beta_n, alpha_1..alpha_n] in m and rad for
/// concentric tubes.
using ArmVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxJointsPerArm, 1>;

/// Joint vector of a whole robot, arms stacked in the order of the robot file.
using RobotVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxJoints, 1>;

}  // namespace tandem::safety
