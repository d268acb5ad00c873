// SPDX-License-Identifier: Apache-2.0
/** @file Freedom of tasks: what the tasks of higher priority leave to each one, at joints, before a run. */
#pragma once

#include <string>
#include <vector>

#include "planning/pose_problem.h"
#include "planning/trajectory.h"

namespace tandem::planning {

/// A direction in which joint motion of 1 m, or of 1 rad counted as kinematics::kLengthPerRadian, moves a task by less
/// than this fraction of it counts as lost: MethodParameters::singular_lever, 0.5 mm/rad.
inline constexpr double kLostDirection = 0.01;

/** Freedom of one task over the points of a trajectory. */
struct TaskFreedom {
  TaskReference task;  ///< kind and arms
  int rows = 0;        ///< degrees of freedom that it takes
  int rank = 0;        ///< of them left by the tasks before it, the fewest at any point
  int rank_point = 0;  ///< where; 0: the start
  /// Smallest singular value of J_k N_(k-1), the task's Jacobian in the null space of the tasks before it, and where.
  /// Dimensionless: rows in m, rotations of joints and tips counted as kinematics::kLengthPerRadian.
  double least = 0.0;
  int least_point = 0;

  /// A shaft that cannot be moved back to its path may be on it all the same: its deviation says what the tubes allow.
  bool follows_leader = false;

  /// Of a soft task, whose rank is zero wherever nothing is near: the least distance on the path, m or a stability,
  /// where it is, and how many points are nearer than the distance d of the task.
  double nearest = safety::kUnlimited;
  int nearest_point = 0, near_points = 0;

  bool soft() const noexcept { return kinematics::findTaskKind(task.kind)->soft(); }
  /// Nothing is left to it at some point.
  bool lost() const noexcept { return rank == 0 && !follows_leader && !soft(); }
};

/** Freedom of every task of a trajectory, in the order of their priorities:
 *
 *     J_k N_(k-1) = U S V^T,   rank_k = number of s_i > kLostDirection,   N_k = N_(k-1) - V_r V_r^T,   N_0 = I,
 *
 * with V_r the columns of V of these s_i. A soft task takes its direction only where it is in force, h = 1.
 * @param path  joints of all arms, one column per point, the start first: FeasibilityReport::pathFrom()
 * @return empty if no point has a solution of the models */
std::vector<TaskFreedom> taskFreedom(const Arms& arms, const TrajectorySpec& spec, const Eigen::MatrixXd& path);

/// Reason why a task cannot be followed at all; empty: none. @param arms  names
std::string lostTask(const std::vector<TaskFreedom>& freedom, const std::vector<std::string>& arms);

}  // namespace tandem::planning
