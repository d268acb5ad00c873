// SPDX-License-Identifier: Apache-2.0
/** @file Input of one control step: stacked Jacobians, desired velocities, limits. Independent of arm type, time and
 * I/O. */
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "safety/limits.h"

namespace tandem::control {

using safety::RobotVector;

inline constexpr int kMaxTasks = 4;
inline constexpr int kMaxTaskRows = 6;
/// Largest number of coupled rows of a robot: two per pair of neighbouring tubes.
inline constexpr int kMaxRows = 2 * 3 * safety::kMaxArms;

using TaskJacobian =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxTaskRows, safety::kMaxJoints>;
using TaskVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxTaskRows, 1>;

/** Task J qdot = v. */
struct Task {
  TaskJacobian jacobian;    ///< rows x joints of the robot
  TaskVector velocity;      ///< v, m/s (rad/s)
  double activation = 1.0;  ///< h in [0, 1]: 1 a task like all others, 0 none; see Resolver::solve()
};

using safety::JointKind;

/** State and limits of one joint. SI. */
struct JointState {
  JointKind kind = JointKind::kTranslation;
  double position = 0.0;
  double lower = -safety::kUnlimited;  ///< box
  double upper = safety::kUnlimited;
  double frozen_lower = -safety::kUnlimited;  ///< beta_min, beta_max of equation (1) with a stationary inner neighbour
  double frozen_upper = safety::kUnlimited;
  double moving_lower = -safety::kUnlimited;  ///< the same with both neighbours stationary, for plots
  double moving_upper = safety::kUnlimited;
  double velocity = safety::kUnlimited;               ///< V_max
  double approach_acceleration = safety::kUnlimited;  ///< A_max
};

/** Constraint gap = b - a^T q >= 0; a has at most two entries, `first` and `second`. */
struct CoupledRow {
  int first = 0;
  int second = 0;
  double a_first = 0.0;
  double a_second = 0.0;
  double gap = 0.0;  ///< b - a^T q at the present position, m
  double approach_acceleration = safety::kUnlimited;
};

/// Largest number of margins: elastic stability of every arm and distances of the arms of every task.
inline constexpr int kMaxBarriers = safety::kMaxArms + kMaxTasks;

/** A margin h(q) to be kept above its least value, as a velocity damper (Faverjon & Tournassoud 1987): gradient^T qdot
 * >= rate, rate = -gain (h - least). */
struct Barrier {
  RobotVector gradient;  ///< of h with respect to all joints
  double rate = 0.0;     ///< of h; positive: h must increase
};

/** Input of a redundancy-resolution method for one step. Reused from step to step: no allocation. */
struct StepProblem {
  int joint_count = 0;
  int arm_count = 0;
  std::array<int, safety::kMaxArms + 1> arm_offset{};  ///< joints of arm k are arm_offset[k] .. arm_offset[k+1]-1
  std::array<JointState, safety::kMaxJoints> joint{};
  int row_count = 0;
  std::array<CoupledRow, kMaxRows> row{};
  int task_count = 0;
  std::array<Task, kMaxTasks> task{};  ///< highest priority first
  int barrier_count = 0;
  std::array<Barrier, kMaxBarriers> barrier{};  ///< used by hqp only
  RobotVector posture;                          ///< q_p, preferred joints as far as tasks leave them free; empty: none

  /// Sets the arms and their limits, without tasks. Call once, then setPosition() each step.
  void setLimits(const safety::ArmLimits* const* limits, int count);
  /// Sets the joint positions (all arms stacked) and updates gaps and frozen intervals.
  void setPosition(const RobotVector& q);

 private:
  std::array<double, kMaxRows> row_bound_{};  ///< b
};

/** Bounds on velocities of one step. */
struct VelocityBounds {
  RobotVector lower;
  RobotVector upper;
  int row_count = 0;                        ///< 0 for frozen bounds
  std::array<double, kMaxRows> row_rate{};  ///< a^T qdot <= row_rate
  /// Step bounds of a method, independent of the limits, m/s and rad/s; infinite: none.
  double step_translation = safety::kUnlimited, step_rotation = safety::kUnlimited;
};

}  // namespace tandem::control
