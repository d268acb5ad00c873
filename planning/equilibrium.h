// SPDX-License-Identifier: Apache-2.0
/** @file Struct of fixed size for a linearised equilibrium of the common object: input of a control step. */
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "control/step_problem.h"

namespace tandem::planning {

/** A task in addition to the motion of the object: A qdot = gain * velocity. */
struct EquilibriumTask {
  int rows = 0;
  std::array<double, control::kMaxTaskRows * safety::kMaxJoints> jacobian{};  ///< A, row by row, joint by joint
  std::array<double, control::kMaxTaskRows> velocity{};                       ///< for a gain of 1/s
};

/** An equilibrium of a mechanism (robots/mechanism.h). A plain struct of fixed size, passed between threads. */
struct Equilibrium {
  int joint_count = 0;                                    ///< 0: no equilibrium is known
  std::array<double, safety::kMaxJoints> joints{};        ///< m, rad
  std::array<double, 3> position{};                       ///< of the object, m, robot base frame
  std::array<double, 9> rotation{};                       ///< likewise, column by column
  std::array<double, 6 * safety::kMaxJoints> jacobian{};  ///< twist of the object per joint velocity, column by column
  double length = 1.0;                                    ///< length that converts radians to metres, m
  double residual = 0.0;                                  ///< residual of the higher-priority tasks, m
  int higher_count = 0, lower_count = 0;
  /// Tasks of higher priority than the motion, highest first, then those of lower priority.
  std::array<EquilibriumTask, control::kMaxTasks - 1> tasks{};

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
