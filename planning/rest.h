// SPDX-License-Identifier: Apache-2.0
/** @file Rest: equilibrium of arms that move one thing together, as plain numbers for a control step.
 */
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "control/step_problem.h"

namespace tandem::planning {

/** A task of the arms' own, beside that of what they move: A qdot = gain * velocity. */
struct RestTask {
  int rows = 0;
  std::array<double, control::kMaxTaskRows * safety::kMaxJoints> jacobian{};  ///< A, row by row, joint by joint
  std::array<double, control::kMaxTaskRows> velocity{};                       ///< for a gain of 1/s
};

/** A rest of a mechanism (robots/mechanism.h). A plain struct of fixed size: one thread hands it to another. */
struct Rest {
  int joint_count = 0;                                    ///< 0: none is known
  std::array<double, safety::kMaxJoints> joints{};        ///< where it is, m, rad
  std::array<double, 3> position{};                       ///< of what is moved, m, robot base frame
  std::array<double, 9> rotation{};                       ///< likewise, column by column
  std::array<double, 6 * safety::kMaxJoints> jacobian{};  ///< of that frame by joints, column by column
  double length = 1.0;                                    ///< m that a radian counts as
  double drift = 0.0;                                     ///< by how much what comes before the motion is not so, m
  int above_count = 0, below_count = 0;
  /// Those that come before the motion, highest priority first, and then those that come after it.
  std::array<RestTask, control::kMaxTasks - 1> tasks{};

  bool known() const noexcept { return joint_count > 0; }
  auto q() const noexcept { return Eigen::Map<const Eigen::VectorXd>(joints.data(), joint_count); }
  auto motion() const noexcept {
    return Eigen::Map<const Eigen::Matrix<double, 6, Eigen::Dynamic>>(jacobian.data(), 6, joint_count);
  }
  Eigen::Isometry3d pose() const noexcept {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Eigen::Vector3d::Map(position.data());
    pose.linear() = Eigen::Matrix3d::Map(rotation.data());
    return pose;
  }
};

}  // namespace tandem::planning
