// SPDX-License-Identifier: Apache-2.0
#include "planning/reference_tracker.h"

#include <stdexcept>

namespace tandem::planning {

ReferenceTracker::ReferenceTracker(std::vector<const kinematics::ArmModel*> models,
                                   std::vector<const safety::ArmLimits*> limits,
                                   control::Method method,
                                   const control::MethodParameters& parameters,
                                   Gains gains)
    : models_(std::move(models)), resolver_(control::makeResolver(method, parameters)), gains_(gains) {
  if (models_.empty() || models_.size() != limits.size() || models_.size() > safety::kMaxArms) {
    throw std::invalid_argument("a tracker needs 1 to 8 arms, each with model and limits");
  }
  for (std::size_t k = 0; k < models_.size(); ++k) {
    if (limits[k]->jointCount() != models_[k]->arm().jointCount()) {
      throw std::invalid_argument("limits and model of an arm differ in their number of joints");
    }
  }
  problem_.setLimits(limits.data(), static_cast<int>(limits.size()));
}

bool ReferenceTracker::computeTips(const safety::RobotVector& q, TrackResult& result) const noexcept {
  for (int k = 0; k < problem_.arm_count; ++k) {
    const int begin = problem_.arm_offset[k], size = problem_.arm_offset[k + 1] - begin;
    result.model = models_[k]->tip(q.segment(begin, size), result.tip[k]);
    if (result.model != kinematics::ModelStatus::kOk) {
      result.model_arm = k;
      return false;
    }
  }
  return true;
}

bool ReferenceTracker::setTask(const TaskReference& wanted,
                               const TrackResult& result,
                               control::Task& task,
                               double& error) noexcept {
  const bool relative = wanted.kind == TaskKind::kRelativePosition;
  const auto known = [&](int arm) { return arm >= 0 && arm < problem_.arm_count; };
  if (!relative && wanted.kind != TaskKind::kTipPosition)
    return false;
  if (!known(wanted.arm) || (relative && (!known(wanted.other_arm) || wanted.other_arm == wanted.arm)))
    return false;
  if (!wanted.position.allFinite() || !wanted.feed_forward.allFinite())
    return false;

  Eigen::Vector3d position = result.tip[wanted.arm].pose.translation();
  task.jacobian.setZero(3, problem_.joint_count);
  const auto columns = [&](int arm) {
    const int begin = problem_.arm_offset[arm];
    return task.jacobian.middleCols(begin, problem_.arm_offset[arm + 1] - begin);
  };
  columns(wanted.arm) = result.tip[wanted.arm].jacobian.topRows<3>();
  if (relative) {
    position -= result.tip[wanted.other_arm].pose.translation();
    columns(wanted.other_arm) = -result.tip[wanted.other_arm].jacobian.topRows<3>();
  }
  const Eigen::Vector3d difference = wanted.position - position;
  error = difference.norm();
  task.velocity = (relative ? gains_.relative : gains_.tip) * difference + wanted.feed_forward;
  return true;
}

void ReferenceTracker::step(const safety::RobotVector& q,
                            const safety::RobotVector& setpoint,
                            const Reference& reference,
                            TrackResult& result) noexcept {
  result.status = TrackStatus::kOk;
  result.error.fill(0.0);
  result.solution.velocity.setZero(problem_.joint_count);
  result.solution.status = control::SolveStatus::kFailed;
  result.solution.scale.fill(0.0);
  result.solution.residual.fill(0.0);
  if (q.size() != problem_.joint_count || setpoint.size() != q.size() || !computeTips(q, result)) {
    result.status = TrackStatus::kModel;
    return;
  }
  problem_.setPosition(setpoint);
  problem_.task_count = reference.task_count;
  if (reference.task_count < 0 || reference.task_count > kMaxTasks) {
    problem_.task_count = 0;
    result.status = TrackStatus::kReference;
    return;
  }
  for (int k = 0; k < reference.task_count; ++k) {
    if (!setTask(reference.tasks[k], result, problem_.task[k], result.error[k])) {
      result.status = TrackStatus::kReference;
      return;
    }
  }
  resolver_->solve(problem_, result.solution);
  if (result.solution.status != control::SolveStatus::kSolved)
    result.status = TrackStatus::kSolver;
}

}  // namespace tandem::planning
