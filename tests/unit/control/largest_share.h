// SPDX-License-Identifier: Apache-2.0
/** @file Largest feasible scale of the first task: reference for the task scales of the methods. */
#pragma once

#include "control/quadratic_program.h"
#include "control/solution.h"

namespace tandem::test {

/** The linear programme max s, J_1 qdot = s v_1, 0 <= s <= most, inside all limits; s is the variable after the
 * velocities.
 * @param curvature  of the objective, for solvers that require some */
inline control::QuadraticProgram largestShare(const control::StepProblem& problem,
                                              const control::VelocityBounds& bounds,
                                              double most = 1.0,
                                              double curvature = 0.0) {
  const int n = problem.joint_count;
  control::QuadraticProgram lp;
  lp.resize(n + 1, static_cast<int>(problem.task[0].velocity.size()), bounds.row_count);
  lp.H.diagonal().setConstant(curvature);
  lp.g[n] = -1.0;
  lp.E.leftCols(n) = problem.task[0].jacobian;
  lp.E.col(n) = -problem.task[0].velocity;
  lp.lower << bounds.lower, 0.0;
  lp.upper << bounds.upper, most;
  for (int i = 0; i < bounds.row_count; ++i) {
    lp.A(i, problem.row[i].first) = problem.row[i].a_first;
    lp.A(i, problem.row[i].second) = problem.row[i].a_second;
    lp.b[i] = bounds.row_rate[i];
  }
  return lp;
}

}  // namespace tandem::test
