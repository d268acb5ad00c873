// SPDX-License-Identifier: Apache-2.0
/** @file One control step of the two arms of Alsaka et al. 2024 at random joints inside equation (1). */
#pragma once

#include <algorithm>
#include <limits>

#include "control/solution.h"
#include "control/step_problem.h"
#include "kinematics/rigid_model.h"
#include "tests/unit/support/random_tubes.h"

namespace tandem::test {

/** Problem with the relative position as first task and tip A as second. */
struct ArkProblem {
  kinematics::RigidModel a{arkArm(0.005)}, b{arkArm(-0.005)};
  safety::ArmLimits limits = limitsOf(arkArm(0.0), 5e-3, 1e-3);
  control::StepProblem problem;

  ArkProblem() {
    const safety::ArmLimits* both[] = {&limits, &limits};
    problem.setLimits(both, 2);
  }

  /// @return false if a model has no solution.
  bool set(const Eigen::VectorXd& q_a,
           const Eigen::VectorXd& q_b,
           const Eigen::Vector3d& v_ab,
           const Eigen::Vector3d& v_a) {
    kinematics::Tip tip_a, tip_b;
    if (a.tip(q_a, tip_a) != kinematics::ModelStatus::kOk || b.tip(q_b, tip_b) != kinematics::ModelStatus::kOk)
      return false;
    control::RobotVector q(12);
    q << q_a, q_b;
    problem.setPosition(q);
    problem.task_count = 2;
    problem.task[0].jacobian.setZero(3, 12);
    problem.task[0].jacobian << tip_a.jacobian.topRows<3>(), -tip_b.jacobian.topRows<3>();
    problem.task[0].velocity = v_ab;
    problem.task[1].jacobian.setZero(3, 12);
    problem.task[1].jacobian.leftCols(6) = tip_a.jacobian.topRows<3>();
    problem.task[1].velocity = v_a;
    return true;
  }

  bool setRandom(Random& random, double speed) {
    return set(randomInside(limits, random), randomInside(limits, random), anyVector(random, 0.1 * speed),
               anyVector(random, speed));
  }
};

/// Largest excess of a solution's velocity over its bounds and rows, m/s or rad/s; negative inside all of them.
inline double excess(const control::StepProblem& problem, const control::Solution& s) {
  double worst = -std::numeric_limits<double>::infinity();
  for (int j = 0; j < problem.joint_count; ++j)
    worst = std::max({worst, s.bounds.lower[j] - s.velocity[j], s.velocity[j] - s.bounds.upper[j]});
  for (int i = 0; i < s.bounds.row_count; ++i) {
    const auto& row = problem.row[i];
    worst = std::max(
        worst, row.a_first * s.velocity[row.first] + row.a_second * s.velocity[row.second] - s.bounds.row_rate[i]);
  }
  return worst;
}

}  // namespace tandem::test
