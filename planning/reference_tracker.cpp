// SPDX-License-Identifier: Apache-2.0
#include "planning/reference_tracker.h"

#include <cmath>
#include <stdexcept>

namespace tandem::planning {
namespace {

bool isUsable(const TaskReference& wanted) noexcept {
  constexpr double kRounding = 1e-6;
  return wanted.position.allFinite() && wanted.feed_forward.allFinite() && wanted.angular_feed_forward.allFinite() &&
         std::abs(wanted.orientation.norm() - 1.0) < kRounding;
}

}  // namespace

ReferenceTracker::ReferenceTracker(std::vector<const kinematics::ArmModel*> models,
                                   std::vector<const safety::ArmLimits*> limits,
                                   control::Method method,
                                   const control::MethodParameters& parameters,
                                   Gains gains)
    : tips_(models, limits),
      margins_(models, parameters),
      resolver_(control::makeResolver(method, parameters)),
      gains_(gains) {
  if (models.size() != limits.size())
    throw std::invalid_argument("reference tracker: found limits of " + std::to_string(limits.size()) +
                                " arms, expected one for each of the " + std::to_string(models.size()) + " models");
  for (std::size_t k = 0; k < models.size(); ++k) {
    if (limits[k]->jointCount() != models[k]->jointCount()) {
      throw std::invalid_argument("reference tracker: found " + std::to_string(limits[k]->jointCount()) +
                                  " joints in the limits of arm " + std::to_string(k) + ", expected the " +
                                  std::to_string(models[k]->jointCount()) + " of its model");
    }
  }
  problem_.setLimits(limits.data(), static_cast<int>(limits.size()));
}

ReferenceTracker ReferenceTracker::ofObject(const std::vector<const safety::ArmLimits*>& limits,
                                            const safety::RobotVector& posture,
                                            control::Method method,
                                            const control::MethodParameters& parameters,
                                            Gains gains) {
  ReferenceTracker tracker(method, parameters, gains);
  tracker.problem_.setLimits(limits.data(), static_cast<int>(limits.size()));
  tracker.posture_ = posture;
  if (posture.size() != tracker.problem_.joint_count)
    throw std::invalid_argument("posture: found " + std::to_string(posture.size()) + " joints, expected " +
                                std::to_string(tracker.problem_.joint_count) + ", as many as the limits have");
  return tracker;
}

bool ReferenceTracker::computeTips(const safety::RobotVector& q, TrackResult& result) noexcept {
  const bool known = tips_.update(q);
  result.model = tips_.status();
  result.model_arm = tips_.failedArm();
  for (int k = 0; k < problem_.arm_count; ++k)
    result.tip[static_cast<std::size_t>(k)] = tips_.tip(k);
  return known;
}

void ReferenceTracker::observe(const safety::RobotVector& q, const safety::RobotVector& setpoint) noexcept {
  tips_.update(q);
  problem_.setPosition(setpoint);
}

TrackStatus ReferenceTracker::setTask(const TaskReference& wanted,
                                      const MeasuredTips* measured,
                                      TrackResult& result,
                                      control::Task& task,
                                      double& error) noexcept {
  const kinematics::TaskKindEntry* kind = kinematics::findTaskKind(wanted.kind);
  const auto known = [&](int arm) { return arm >= 0 && arm < problem_.arm_count; };
  if (kind == nullptr || !known(wanted.arm))
    return TrackStatus::kReference;
  const bool relative = kind->relative();
  if (relative && (!known(wanted.other_arm) || wanted.other_arm == wanted.arm))
    return TrackStatus::kReference;
  if (!isUsable(wanted))
    return TrackStatus::kReference;
  if (kind->soft())
    return setSoftTask(wanted, *kind, task, error);
  const auto missing = [&](int arm) {
    const MeasuredTips::Entry& tip = measured->arm[arm];
    return !tip.known || (kind->needsOrientation() && measured->useOrientations() && !tip.oriented.known);
  };
  if (measured && (missing(wanted.arm) || (relative && missing(wanted.other_arm))))
    return TrackStatus::kSensor;

  const auto pose_of = [&](int arm) { return measuredPose(result.tip[arm].pose, measured, arm); };
  const bool shaft = kind->point == kinematics::TaskPoint::kShaft;
  if (shaft) {
    result.model = tips_.shaftPoint(wanted.arm, wanted.position, true, foot_);
    result.model_arm = wanted.arm;
    if (result.model != kinematics::ModelStatus::kOk)
      return TrackStatus::kModel;
  }
  const Eigen::Isometry3d pose = shaft ? foot_.pose : pose_of(wanted.arm);
  const Eigen::Isometry3d other = relative ? pose_of(wanted.other_arm) : pose;
  const kinematics::Jacobian& jacobian = shaft ? foot_.jacobian : result.tip[wanted.arm].jacobian;
  const kinematics::TaskPlace at = kind->place(pose, other), place = wanted.place();
  kinematics::TaskRows rows;
  rows.residual = kind->residual(at, place);
  kind->maps(at, place, other, rows);
  const double length = kind->length();
  task.activation = 1.0;
  task.jacobian.setZero(kind->rows, problem_.joint_count);
  const auto columns = [&](int arm) {
    const int begin = problem_.arm_offset[arm];
    return task.jacobian.middleCols(begin, problem_.arm_offset[arm + 1] - begin);
  };
  columns(wanted.arm).noalias() = length * rows.by_arm.lazyProduct(jacobian);
  if (relative)
    columns(wanted.other_arm).noalias() = length * rows.by_other.lazyProduct(result.tip[wanted.other_arm].jacobian);
  error = length * rows.residual.norm();
  Eigen::Matrix<double, 6, 1> feed_forward;
  feed_forward << wanted.feed_forward, wanted.angular_feed_forward;
  task.velocity = length * ((relative ? gains_.relative : gains_.tip) * rows.residual +
                            rows.by_feed_forward.lazyProduct(feed_forward));
  return TrackStatus::kOk;
}

TrackStatus ReferenceTracker::setSoftTask(const TaskReference& wanted,
                                          const kinematics::TaskKindEntry& kind,
                                          control::Task& task,
                                          double& error) noexcept {
  const double distance = wanted.position.x();
  if (!(distance > 0.0))
    return TrackStatus::kReference;
  const kinematics::Avoidance avoidance = tips_.avoidance(wanted.arm, kind.point, distance);
  const int begin = problem_.arm_offset[wanted.arm];
  task.jacobian.setZero(kind.rows, problem_.joint_count);
  task.jacobian.middleCols(begin, problem_.arm_offset[wanted.arm + 1] - begin) = kind.length() * avoidance.gradient;
  error = kind.length() * avoidance.cost;
  task.velocity.setConstant(kind.rows, -gains_.tip * error);
  task.activation = avoidance.activation;
  return TrackStatus::kOk;
}

void ReferenceTracker::clear(TrackResult& result) const noexcept {
  result.status = TrackStatus::kOk;
  result.first_task = 0;
  result.error.fill(0.0);
  result.solution.velocity.setZero(problem_.joint_count);
  result.solution.status = control::SolveStatus::kFailed;
  result.solution.scale.fill(0.0);
  result.solution.residual.fill(0.0);
  result.solution.iterations = 0;
  result.solution.active_count = 0;
  result.solution.joint_active.fill(0);
  result.solution.kkt_residual = 0.0;
}

void ReferenceTracker::hold(const safety::RobotVector& q,
                            const safety::RobotVector& setpoint,
                            TrackStatus reason,
                            TrackResult& result) noexcept {
  clear(result);
  result.status = tips_.armCount() == 0 || computeTips(q, result) ? reason : TrackStatus::kModel;
  problem_.setPosition(setpoint);
  problem_.task_count = 0;
}

void ReferenceTracker::step(const safety::RobotVector& q,
                            const safety::RobotVector& setpoint,
                            const Reference& reference,
                            const MeasuredTips* measured,
                            TrackResult& result) noexcept {
  clear(result);
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
  problem_.posture = reference.posture;
  const bool posture = reference.posture.size() > 0;
  if (posture && (reference.posture.size() != problem_.joint_count || !reference.posture.allFinite())) {
    problem_.task_count = 0;
    problem_.posture.resize(0);
    result.status = TrackStatus::kReference;
    return;
  }
  for (int k = 0; k < reference.task_count; ++k) {
    result.status = setTask(reference.tasks[k], measured, result, problem_.task[k], result.error[k]);
    if (result.status != TrackStatus::kOk)
      return;
  }
  margins_.set(tips_, q, reference, problem_);
  solve(result);
  if (result.status == TrackStatus::kOk && resolver_->method() == control::Method::kHqp)
    margins_.keep(tips_, q, problem_, result.solution);
}

void ReferenceTracker::solve(TrackResult& result) noexcept {
  resolver_->solve(problem_, result.solution);
  const control::SolveStatus status = result.solution.status;
  if (status != control::SolveStatus::kSolved && status != control::SolveStatus::kInfeasible)
    result.status = TrackStatus::kSolver;
}

}  // namespace tandem::planning
