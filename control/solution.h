// SPDX-License-Identifier: Apache-2.0
/** @file Result of a redundancy-resolution method. */
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "control/step_problem.h"
#include "idl/enumerations.h"

namespace tandem::control {

using idl::name;
using idl::SolveStatus;

/** Limits that forbid a task, by the multipliers of a certificate of infeasibility (Farkas' lemma). */
struct Conflict {
  enum class Kind : std::uint8_t { kLower, kUpper, kRow };
  struct Limit {
    Kind kind = Kind::kLower;
    int index = 0;        ///< joint of the robot, or coupled row
    double weight = 0.0;  ///< multiplier
    double bound = 0.0;   ///< the bound on the velocity, m/s or rad/s
    bool step = false;    ///< a step bound of the method, not a limit of the robot
  };
  static constexpr int kMost = 8;
  std::array<Limit, kMost> limit{};  ///< largest weight first
  int count = 0;
};

/** Joint velocities and their properties. */
struct Solution {
  SolveStatus status = SolveStatus::kFailed;
  RobotVector velocity;                      ///< qdot, m/s and rad/s
  std::array<double, kMaxTasks> scale{};     ///< s_k: fraction of task k done by design, 1 = all
  std::array<double, kMaxTasks> residual{};  ///< |J_k qdot - v_k|: residual of task k, m/s
  int iterations = 0;                        ///< of the QP backend, all levels; 0 for closed forms
  double kkt_residual = 0.0;                 ///< worst level; 0 for closed forms
  VelocityBounds bounds;                     ///< bounds in use; infinite for methods without limits
  std::array<std::uint8_t, safety::kMaxJoints>
      joint_active{};    ///< 1: qdot is at a bound of the joint or at one of its rows
  int active_count = 0;  ///< number of active bounds and rows
  Conflict conflict;     ///< kInfeasible: the limits that forbid the task
};

}  // namespace tandem::control
