// SPDX-License-Identifier: Apache-2.0
#include "control/obstructing_limits.h"

#include <algorithm>

#include "control/conflict.h"
#include "control/detail/qp_methods.h"

namespace tandem::control {
namespace {

Conflict findObstructing(const StepProblem& problem, const MethodParameters& parameters) {
  constexpr double kWeak = 1e-2;  // of the largest multiplier
  Conflict conflict;
  VelocityBounds bounds;
  velocityBounds(problem, BoundsKind::kCoupled, parameters.period, bounds);
  boundSteps(problem, parameters.translation_step / parameters.period, parameters.rotation_velocity, bounds);
  QuadraticProgram qp;
  qp.resize(problem.joint_count, 0, bounds.row_count);
  addLimits(problem, bounds, qp);
  qp.H.diagonal().setConstant(parameters.nspqp_zeta);
  double pull = 0.0;
  for (int k = 0; k < problem.task_count; ++k) {
    const Task& task = problem.task[k];
    qp.H += task.jacobian.transpose().lazyProduct(task.jacobian);
    qp.g -= task.jacobian.transpose().lazyProduct(task.velocity);
    pull += task.jacobian.squaredNorm() * task.velocity.norm();
  }
  QpSolution solution;
  makeQpBackend(Backend::kActiveSet)->solve(qp, solution);
  if (solution.status != QpStatus::kSolved)
    return conflict;
  explain(problem, bounds, solution, conflict);
  constexpr double kNothing = 1e-9;  // relative to the gradient of the tasks
  while (conflict.count > 0 && (conflict.limit[conflict.count - 1].weight < kWeak * conflict.limit[0].weight ||
                                conflict.limit[conflict.count - 1].weight < kNothing * pull))
    --conflict.count;
  return conflict;
}

}  // namespace

std::vector<std::string> obstructingLimits(const StepProblem& problem,
                                           const MethodParameters& parameters,
                                           const std::vector<std::string>& arms,
                                           bool steps) {
  const Conflict conflict = findObstructing(problem, parameters);
  std::vector<std::string> names;
  for (int i = 0; i < conflict.count; ++i) {
    const std::string text = describe(nameOf(problem, conflict.limit[i]), arms);
    if ((steps || !conflict.limit[i].step) && std::find(names.begin(), names.end(), text) == names.end())
      names.push_back(text);
  }
  return names;
}

}  // namespace tandem::control
