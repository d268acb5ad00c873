// SPDX-License-Identifier: Apache-2.0
#include "services/control/object_loop.h"

#include <spdlog/spdlog.h>

#include <algorithm>

namespace tandem::control_service {

using planning::TrackStatus;

ObjectLoop::ObjectLoop(const runtime::Setup& setup)
    : setup_(setup),
      period_(setup.deployment.control_period),
      oldest_(std::max(5.0 * period_, setup.deployment.budgets.commandAge(period_))) {
  if (setup.deployment.clock == config::ClockMode::kLockStep)
    follower_.emplace(robots::makeEquilibriumFollower(setup.robot));
  else
    equilibrium_solver_ = std::make_unique<EquilibriumSolver>(setup);
}

void ObjectLoop::start() {
  if (equilibrium_solver_)
    equilibrium_solver_->start();
}

void ObjectLoop::stop() {
  if (equilibrium_solver_)
    equilibrium_solver_->stop();
}

void ObjectLoop::restart() noexcept {
  ++joint_resets_;
  if (follower_)
    follower_.emplace(robots::makeEquilibriumFollower(setup_.robot));
}

void ObjectLoop::stepAtOnce(const safety::RobotVector& q,
                            const planning::Reference& tasks,
                            planning::ReferenceTracker& tracker,
                            planning::TrackResult& result) {
  const auto solve = [this](const safety::RobotVector& joints) { return follower_->solveEquilibrium(joints); };
  const std::string why =
      robots::stepByMiddle(follower_->mechanism(), solve, tracker, q, tasks.object, period_, equilibrium_, result);
  if (why.empty())
    return;
  spdlog::error("no equilibrium of the common object at the present joints: {}", why);
  tracker.hold(q, q, TrackStatus::kModel, result);
}

dds::HoldReason ObjectLoop::step(std::int64_t now,
                                 const safety::RobotVector& setpoint,
                                 const safety::RobotVector& velocity,
                                 const planning::Reference& tasks,
                                 planning::ReferenceTracker& tracker,
                                 planning::TrackResult& result) noexcept {
  if (tasks.task_count != 1 || tasks.tasks[0].kind != planning::TaskKind::kObjectPose) {
    tracker.hold(setpoint, setpoint, TrackStatus::kReference, result);
    return dds::HoldReason::kNone;
  }
  if (follower_) {
    stepAtOnce(setpoint, tasks, tracker, result);
    return dds::HoldReason::kNone;
  }
  equilibrium_solver_->take(latest_);
  const double age = 1e-9 * static_cast<double>(now - latest_.stamp);
  if (!latest_.equilibrium.known() || latest_.joint_resets != joint_resets_ || age > oldest_) {
    tracker.hold(setpoint, setpoint, TrackStatus::kNoEquilibrium, result);
    return dds::HoldReason::kNoEquilibrium;
  }
  const safety::RobotVector middle = tracker.moved(setpoint, 0.5 * period_ * velocity);
  tracker.step(latest_.equilibrium, middle, setpoint, tasks.object.after(0.5 * period_), result);
  return dds::HoldReason::kNone;
}

void ObjectLoop::requestEquilibrium(std::int64_t now,
                                    const safety::RobotVector& setpoint,
                                    const safety::RobotVector& velocity,
                                    const planning::ReferenceTracker& tracker) noexcept {
  if (!equilibrium_solver_)
    return;
  request_.stamp = now;
  request_.joint_resets = joint_resets_;
  request_.joint_count = static_cast<int>(setpoint.size());
  Eigen::VectorXd::Map(request_.joints.data(), setpoint.size()) = tracker.moved(setpoint, 1.5 * period_ * velocity);
  equilibrium_solver_->submit(request_);
}

}  // namespace tandem::control_service
