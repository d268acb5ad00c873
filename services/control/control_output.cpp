// SPDX-License-Identifier: Apache-2.0
/** @file ControlCore: what a cycle says. */
#include <algorithm>

#include "services/control/control_core.h"

namespace tandem::service {

void ControlCore::fillCommand(std::int64_t now, bool advance, dds::ActuationCommand& command) noexcept {
  command = dds::ActuationCommand{};
  command.control_session = setup_.session;
  command.sequence = ++command_sequence_;
  command.state_session = state_.session;
  command.answers_state = state_.sequence;
  command.stamp = lock_step_ ? state_.stamp : now;
  command.advance = advance ? 1 : 0;
  command.arm_count = static_cast<std::uint8_t>(arm_count_);
  command_times_.record(command.sequence, now);
  for (int k = 0; k < arm_count_; ++k) {
    const ArmControl& arm = arm_[k];
    const auto i = static_cast<std::size_t>(k);
    command.request[i] = static_cast<std::uint8_t>(requestFor(k));
    command.without[i] = arm.without;
    command.moving[i] = moves_[i] && arm.machine.mayMove() ? 1 : 0;
    const auto from = base_.segment(robot_.offset(k), robot_.size(k));
    for (int j = 0; j < robot_.size(k); ++j) {
      const double velocity = command.moving[i] != 0 ? velocity_[robot_.offset(k) + j] : 0.0;
      command.velocity[dds::jointIndex(k, j)] = velocity;
      command.position[dds::jointIndex(k, j)] = from[j] + period_ * velocity;
      sent_[command.sequence % kSentVelocities][robot_.offset(k) + j] = velocity;
    }
  }
}

void ControlCore::fillLimits(dds::ActuationLimits& limits) const noexcept {
  limits.sequence = command_sequence_;
  limits.answers_state = state_.sequence;
  limits.stamp = state_.stamp;
  limits.arm_count = static_cast<std::uint8_t>(arm_count_);
  const control::StepProblem& problem = tracker_->problem();
  for (int k = 0; k < arm_count_; ++k) {
    limits.joint_count[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(robot_.size(k));
    for (int j = 0; j < robot_.size(k); ++j) {
      const int joint = robot_.offset(k) + j;
      const std::size_t i = dds::jointIndex(k, j);
      limits.lower[i] = problem.joint[static_cast<std::size_t>(joint)].moving_lower;
      limits.upper[i] = problem.joint[static_cast<std::size_t>(joint)].moving_upper;
      const bool solved = tracked_ && track_.solution.bounds.lower.size() > joint;
      limits.velocity_lower[i] = solved ? track_.solution.bounds.lower[joint] : 0.0;
      limits.velocity_upper[i] = solved ? track_.solution.bounds.upper[joint] : 0.0;
      limits.active[i] = solved ? track_.solution.joint_active[static_cast<std::size_t>(joint)] : 0;
    }
  }
}

/// Where the limits forbid the tasks, those of the certificate; where they hold them back, those at which the joints
/// stand.
void ControlCore::fillConflict(dds::ControlStatus& status) noexcept {
  constexpr double kLeft = 0.01;  // of a task's velocity; methods that weigh it against speed leave out less
  const control::Solution& solution = track_.solution;
  const control::Conflict* conflict = nullptr;
  if (solution.status == control::SolveStatus::kInfeasible) {
    conflict = &solution.conflict;
    status.limited = static_cast<std::uint8_t>(dds::Limited::kForbidden);
  } else if (solution.status == control::SolveStatus::kSolved && hold_ == dds::HoldReason::kNone) {
    bool undone = false;
    const auto first = static_cast<std::size_t>(track_.first_task);
    for (std::size_t k = 0; k < static_cast<std::size_t>(tasks_.task_count); ++k)
      undone =
          undone || solution.residual[first + k] > kLeft * tracker_->problem().task[first + k].velocity.norm() + 1e-9;
    if (!undone)
      return;
    control::standingAt(tracker_->problem(), solution, standing_);
    conflict = &standing_;
    status.limited = static_cast<std::uint8_t>(standing_.count > 0 ? dds::Limited::kHeldBack : dds::Limited::kNot);
  }
  if (conflict == nullptr)
    return;
  status.limit_count = static_cast<std::uint8_t>(conflict->count);
  for (int i = 0; i < conflict->count; ++i) {
    const control::NamedLimit limit = control::nameOf(tracker_->problem(), conflict->limit[i]);
    const auto to = static_cast<std::size_t>(i);
    status.limit_kind[to] = static_cast<std::uint8_t>(limit.kind);
    status.limit_arm[to] = static_cast<std::uint8_t>(limit.arm);
    status.limit_tube[to] = static_cast<std::uint8_t>(limit.tube);
    status.limit_bound[to] = conflict->limit[i].bound;
  }
}

void ControlCore::fillStatus(std::int64_t now, dds::ControlStatus& status) noexcept {
  status = dds::ControlStatus{};
  status.session = setup_.session;
  status.sequence = ++status_sequence_;
  status_times_.record(status.sequence, now);
  status.answers_state = state_.sequence;
  status.answers_reference = reference_.sequence;
  status.stamp = lock_step_ ? state_.stamp : now;
  status.method = static_cast<std::uint8_t>(tracker_->method());
  status.arm_count = static_cast<std::uint8_t>(arm_count_);
  status.lease_holder = lease_.holder(now);
  for (int k = 0; k < arm_count_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    status.operating_state[i] = static_cast<std::uint8_t>(shownState(k));
    status.homed[i] = homed(k) ? 1 : 0;
    status.recovery[i] = recovering(k) ? 1 : 0;
    const bool busy = arm_[k].pending || arm_[k].activity == Activity::kMotion ||
                      arm_[k].activity == Activity::kWithdraw || crtk_.busy(k);
    status.busy[i] = busy ? 1 : 0;
    status.faults[i] = arm_[k].machine.faults();
    status.snaps[i] = tracker_->tips().snaps(k);
    status.idle[i] = idle_.idle(k);
    status.idle_left[i] = idle_.left(k);
  }
  if (tracked_) {
    const control::Solution& solution = track_.solution;
    status.solve_status = static_cast<std::uint8_t>(solution.status);
    status.task_count = static_cast<std::uint8_t>(tasks_.task_count);
    for (std::size_t k = 0; k < status.task_count; ++k) {
      status.task_error[k] = track_.error[k];
      const std::size_t of_problem = static_cast<std::size_t>(track_.first_task) + k;
      status.task_scale[k] = solution.scale[of_problem];
      status.task_residual[k] = solution.residual[of_problem];
    }
    status.iterations = static_cast<std::uint32_t>(solution.iterations);
    status.kkt_residual = solution.kkt_residual;
    status.active_limits = static_cast<std::uint32_t>(solution.active_count);
    status.solve_time = solve_time_;
    fillConflict(status);
  }
  bool joints = false;
  for (int k = 0; k < arm_count_; ++k)
    joints = joints ||
             (moves_[static_cast<std::size_t>(k)] && (arm_[k].activity != Activity::kNone || crtk_.movesJoints(k)));
  const bool by_crtk = crtk_.active() && source_ == dds::Source::kNobody;
  status.source = static_cast<std::uint8_t>(by_crtk                                     ? dds::Source::kCrtk
                                            : source_ == dds::Source::kNobody && joints ? dds::Source::kJoints
                                                                                        : source_);
  status.model = setup_.deployment.model == "compliant" ? 1 : 0;
  status.feedback = static_cast<std::uint8_t>(setup_.deployment.feedback);
  status.hold = static_cast<std::uint8_t>(hold_);
  status.tip_age = sensor_ && tracked_ ? tips_.age() : 0.0;
  status.period = period_;
  status.cycle_time = timing_.cycle_time;
  status.cycle_time_max = timing_.cycle_time_max;
  status.jitter_max = timing_.jitter_max;
  status.cycles = timing_.cycles;
  status.overruns = timing_.overruns;
}

}  // namespace tandem::service
