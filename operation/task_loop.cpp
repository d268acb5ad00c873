// SPDX-License-Identifier: Apache-2.0
#include "operation/task_loop.h"

#include <utility>

namespace tandem::operation {

using msg::HoldReason;
using planning::TrackStatus;

TaskLoop::TaskLoop(const ControlSetup& setup,
                   const DriveExchange& drives,
                   std::unique_ptr<planning::ReferenceTracker> tracker,
                   ObjectControl* object_control)
    : setup_(setup),
      drives_(drives),
      tracker_(std::move(tracker)),
      object_control_(object_control),
      sensor_(setup.deployment.feedback == planning::Feedback::kSensor),
      tips_(setup.lockStep(), setup.deployment.budgets.tipAge(setup.period()), setup.deployment.orientation_feedback) {}

void TaskLoop::restart() noexcept {
  tracker_->restart();
  if (object_control_ != nullptr)
    object_control_->restart();
}

planning::ReferenceTracker* TaskLoop::exchange(planning::ReferenceTracker* tracker) noexcept {
  tracker->continueFrom(*tracker_);
  planning::ReferenceTracker* before = tracker_.release();
  tracker_.reset(tracker);
  return before;
}

void TaskLoop::begin() noexcept {
  solved_ = false;
  hold_ = HoldReason::kNone;
}

bool TaskLoop::findTips(planning::teleoperation::TipPlaces& places) noexcept {
  if (!drives_.received() || !tracker_->computeTips(drives_.measured(), result_))
    return false;
  const planning::MeasuredTips* measured = sensor_ ? &tips_.tips() : nullptr;
  for (int k = 0; k < setup_.arms(); ++k) {
    if (measured != nullptr && !measured->knows(k))
      return false;
    const auto i = static_cast<std::size_t>(k);
    const Eigen::Isometry3d pose = planning::measuredPose(result_.tip[i].pose, measured, k);
    places[i] = {pose.translation(), Eigen::Quaterniond(pose.linear())};
  }
  return true;
}

safety::FaultRecord TaskLoop::follow(const planning::Reference& tasks, std::int64_t now) noexcept {
  tasks_ = tasks;
  const std::int64_t start = setup_.clock();
  closeLoop(now);
  solve_time_ = 1e-9 * static_cast<double>(setup_.clock() - start);
  solved_ = true;
  return judge();
}

void TaskLoop::closeLoop(std::int64_t now) noexcept {
  const safety::RobotVector &q = drives_.measured(), &from = drives_.setpoints();
  if (object_control_ != nullptr) {
    hold_ = object_control_->step(now, from, drives_.lastSent(), tasks_, *tracker_, result_);
    return;
  }
  hold_ = sensor_ ? tips_.check(tasks_, drives_.state(), drives_.sendTimes(), now) : HoldReason::kNone;
  if (hold_ != HoldReason::kNone)
    tracker_->hold(q, from, TrackStatus::kSensor, result_);
  else
    tracker_->step(q, from, tasks_, sensor_ ? &tips_.tips() : nullptr, result_);
}

/// A task that the limits forbid is a valid result, with a velocity. Repeated steps without a solution are a fault.
safety::FaultRecord TaskLoop::judge() noexcept {
  using safety::FaultCause;
  const bool no_equilibrium = hold_ == HoldReason::kNoEquilibrium;
  unsolved_ = no_equilibrium || result_.status == TrackStatus::kSolver ? unsolved_ + setup_.period() : 0.0;
  if (result_.status == TrackStatus::kModel)
    return {bit(safety::Fault::kSolver), FaultCause::kModel};
  const double allowed = setup_.deployment.budgets.commandAge(setup_.period());
  if (unsolved_ <= allowed * (1.0 + 1e-9))
    return {};
  return {bit(safety::Fault::kSolver), no_equilibrium ? FaultCause::kModel : FaultCause::kNoSolution, idl::kNoJoint,
          std::exchange(unsolved_, 0.0), allowed};
}

void TaskLoop::prepareNext(std::int64_t now) noexcept {
  if (object_control_ != nullptr && drives_.received())
    object_control_->requestEquilibrium(now, drives_.setpoints(), drives_.lastSent(), *tracker_);
}

void TaskLoop::fill(msg::ActuationLimits& limits) const noexcept {
  limits.sequence = drives_.sequence();
  limits.answers_state = drives_.state().sequence;
  limits.stamp = drives_.state().stamp;
  limits.arm_count = static_cast<std::uint8_t>(setup_.arms());
  const control::StepProblem& problem = tracker_->problem();
  const control::Solution& solution = result_.solution;
  for (int k = 0; k < setup_.arms(); ++k) {
    limits.joint_count[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(setup_.model.size(k));
    for (int j = 0; j < setup_.model.size(k); ++j) {
      const int joint = setup_.model.offset(k) + j;
      const std::size_t i = msg::jointIndex(k, j);
      limits.lower[i] = problem.joint[static_cast<std::size_t>(joint)].moving_lower;
      limits.upper[i] = problem.joint[static_cast<std::size_t>(joint)].moving_upper;
      const bool bounded = solved_ && solution.bounds.lower.size() > joint;
      limits.velocity_lower[i] = bounded ? solution.bounds.lower[joint] : 0.0;
      limits.velocity_upper[i] = bounded ? solution.bounds.upper[joint] : 0.0;
      limits.active[i] = bounded ? solution.joint_active[static_cast<std::size_t>(joint)] : 0;
    }
  }
}

/// Limits that forbid the tasks, from the infeasibility certificate; or active limits that slow the tasks.
const control::Conflict* TaskLoop::conflict(msg::ControlStatus& status) noexcept {
  constexpr double kLeft = 0.01;  // of a task's velocity; above the residual of methods that weigh tasks and speed
  const control::Solution& solution = result_.solution;
  if (solution.status == control::SolveStatus::kInfeasible) {
    status.limited = static_cast<std::uint8_t>(msg::Limited::kForbidden);
    return &solution.conflict;
  }
  if (solution.status != control::SolveStatus::kSolved || hold_ != HoldReason::kNone)
    return nullptr;
  const control::StepProblem& problem = tracker_->problem();
  bool undone = false;
  for (int k = result_.first_task; k < result_.first_task + tasks_.task_count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    undone = undone || solution.residual[i] > kLeft * problem.task[i].velocity.norm() + 1e-9;
  }
  if (!undone)
    return nullptr;
  control::standingAt(problem, solution, standing_);
  status.limited = static_cast<std::uint8_t>(standing_.count > 0 ? msg::Limited::kHeldBack : msg::Limited::kNot);
  return &standing_;
}

void TaskLoop::fill(msg::ControlStatus& status) noexcept {
  status.method = static_cast<std::uint8_t>(tracker_->method());
  status.hold = static_cast<std::uint8_t>(hold_);
  status.feedback = static_cast<std::uint8_t>(setup_.deployment.feedback);
  for (int k = 0; k < setup_.arms(); ++k)
    status.snaps[static_cast<std::size_t>(k)] = tracker_->tips().snaps(k);
  if (!solved_)
    return;
  const control::Solution& solution = result_.solution;
  status.tip_age = sensor_ ? tips_.age() : 0.0;
  status.solve_status = static_cast<std::uint8_t>(solution.status);
  status.task_count = static_cast<std::uint8_t>(tasks_.task_count);
  for (std::size_t k = 0; k < status.task_count; ++k) {
    status.task_error[k] = result_.error[k];
    const std::size_t of_problem = static_cast<std::size_t>(result_.first_task) + k;
    status.task_scale[k] = solution.scale[of_problem];
    status.task_residual[k] = solution.residual[of_problem];
  }
  status.iterations = static_cast<std::uint32_t>(solution.iterations);
  status.kkt_residual = solution.kkt_residual;
  status.active_limits = static_cast<std::uint32_t>(solution.active_count);
  status.solve_time = solve_time_;
  const control::Conflict* limits = conflict(status);
  if (limits == nullptr)
    return;
  status.limit_count = static_cast<std::uint8_t>(limits->count);
  for (int i = 0; i < limits->count; ++i) {
    const control::NamedLimit limit = control::nameOf(tracker_->problem(), limits->limit[i]);
    const auto to = static_cast<std::size_t>(i);
    status.limit_kind[to] = static_cast<std::uint8_t>(limit.kind);
    status.limit_arm[to] = static_cast<std::uint8_t>(limit.arm);
    status.limit_tube[to] = static_cast<std::uint8_t>(limit.tube);
    status.limit_bound[to] = limits->limit[i].bound;
  }
}

}  // namespace tandem::operation
