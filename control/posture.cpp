// SPDX-License-Identifier: Apache-2.0
#include "control/posture.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "control/detail/qp_methods.h"

namespace tandem::control {

RobotVector postureVelocity(const StepProblem& problem, const MethodParameters& parameters, double rotation) noexcept {
  RobotVector velocity(problem.joint_count);
  double share = 1.0;
  for (int j = 0; j < problem.joint_count; ++j) {
    const JointState& joint = problem.joint[j];
    const bool turns = joint.kind == JointKind::kRotation;
    const double most = std::min(joint.velocity, turns ? rotation : parameters.translation_step / parameters.period);
    velocity[j] = parameters.posture_gain * (problem.posture[j] - joint.position);
    if (std::abs(velocity[j]) * share > most)
      share = most / std::abs(velocity[j]);
  }
  velocity *= share;
  return velocity;
}

RobotVector spreadVelocity(const StepProblem& problem, const MethodParameters& parameters) noexcept {
  RobotVector velocity = RobotVector::Zero(problem.joint_count);
  const auto push = [&](double gap) {
    return parameters.spread_gain * std::max(0.0, parameters.spread_distance - gap);
  };
  for (int j = 0; j < problem.joint_count; ++j) {
    const JointState& joint = problem.joint[j];
    if (joint.kind == JointKind::kTranslation)
      velocity[j] += push(joint.position - joint.lower) - push(joint.upper - joint.position);
  }
  for (int i = 0; i < problem.row_count; ++i) {
    const CoupledRow& row = problem.row[i];
    velocity[row.first] -= row.a_first * push(row.gap);
    velocity[row.second] -= row.a_second * push(row.gap);
  }
  double share = 1.0;
  for (int j = 0; j < problem.joint_count; ++j) {
    const double most = std::min(problem.joint[j].velocity, parameters.translation_step / parameters.period);
    if (std::abs(velocity[j]) * share > most)
      share = most / std::abs(velocity[j]);
  }
  velocity *= share;
  return velocity;
}

void addPosture(const StepProblem& problem,
                const MethodParameters& parameters,
                const RobotVector& weights,
                double damping,
                RobotVector& velocity) noexcept {
  if (problem.posture.size() == 0)
    return;
  const int n = problem.joint_count;
  int rows = 0;
  for (int k = 0; k < problem.task_count; ++k)
    rows += static_cast<int>(problem.task[k].velocity.size());
  EqualityMatrix J(rows, n);
  for (int k = 0, row = 0; k < problem.task_count; ++k) {
    J.middleRows(row, problem.task[k].jacobian.rows()) = problem.task[k].jacobian;
    row += static_cast<int>(problem.task[k].jacobian.rows());
  }
  EqualityMatrix weighted = J;
  for (int j = 0; j < n; ++j)
    weighted.col(j) /= weights[j];
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxEqualities, kMaxEqualities> gram =
      weighted.lazyProduct(J.transpose());
  gram.diagonal().array() += damping;
  const RobotVector wanted = postureVelocity(problem, parameters, parameters.rotation_velocity);
  const EqualityVector moved = J.lazyProduct(wanted);
  const EqualityVector y = gram.llt().solve(moved);
  velocity += wanted - weighted.transpose().lazyProduct(y);
}

void PostureWithinLimits::apply(const StepProblem& problem,
                                const RobotVector& wanted,
                                const VelocityBounds& bounds,
                                RobotVector& velocity) noexcept {
  qp_.resize(problem.joint_count, 0, bounds.row_count);
  addLimits(problem, bounds, qp_);
  qp_.H.diagonal().setOnes();
  qp_.g = -wanted;
  backend_->solve(qp_, solution_);
  if (solution_.status == QpStatus::kSolved)
    velocity = solution_.x;
}

}  // namespace tandem::control
