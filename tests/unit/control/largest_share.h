// SPDX-License-Identifier: Apache-2.0
/** @file Largest feasible scale of a task: reference for the task scales of the methods. */
#pragma once

#include "control/quadratic_program.h"
#include "control/solution.h"

namespace tandem::test {

/** The linear programme of task k = `level`, after the velocity p of the levels before it:
 *
 *   max s   s.t.   J_k qdot = J_k p + s (v_k - J_k p),   J_i qdot = J_i p for i < k,   0 <= s <= most,   all limits;
 *
 * s is the variable after the velocities.
 * @param curvature  of the objective, for solvers that require some */
inline control::QuadraticProgram largestShare(const control::StepProblem& problem,
                                              const control::VelocityBounds& bounds,
                                              int level,
                                              const Eigen::VectorXd& before,
                                              double most,
                                              double curvature) {
  const int n = problem.joint_count;
  int equalities = 0;
  for (int i = 0; i <= level; ++i)
    equalities += static_cast<int>(problem.task[i].velocity.size());
  control::QuadraticProgram lp;
  lp.resize(n + 1, equalities, bounds.row_count);
  lp.H.diagonal().setConstant(curvature);
  lp.g[n] = -1.0;
  for (int i = 0, row = 0; i <= level; ++i) {
    const control::Task& task = problem.task[i];
    const int size = static_cast<int>(task.velocity.size());
    const Eigen::VectorXd done = task.jacobian * before;
    lp.E.block(row, 0, size, n) = task.jacobian;
    lp.e.segment(row, size) = done;
    if (i == level)
      lp.E.block(row, n, size, 1) = done - task.velocity;
    row += size;
  }
  lp.lower << bounds.lower, 0.0;
  lp.upper << bounds.upper, most;
  for (int i = 0; i < bounds.row_count; ++i) {
    lp.A(i, problem.row[i].first) = problem.row[i].a_first;
    lp.A(i, problem.row[i].second) = problem.row[i].a_second;
    lp.b[i] = bounds.row_rate[i];
  }
  return lp;
}

/// The same for the first task.
inline control::QuadraticProgram largestShare(const control::StepProblem& problem,
                                              const control::VelocityBounds& bounds,
                                              double most = 1.0,
                                              double curvature = 0.0) {
  return largestShare(problem, bounds, 0, Eigen::VectorXd::Zero(problem.joint_count), most, curvature);
}

}  // namespace tandem::test
