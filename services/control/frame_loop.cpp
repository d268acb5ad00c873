// SPDX-License-Identifier: Apache-2.0
#include "services/control/frame_loop.h"

#include <spdlog/spdlog.h>

#include <algorithm>

namespace tandem::service {

using planning::TrackStatus;

FrameLoop::FrameLoop(const Setup& setup)
    : setup_(setup),
      period_(setup.deployment.control_period),
      oldest_(std::max(5.0 * period_, setup.deployment.budgets.commandAge(period_))) {
  if (setup.deployment.clock == config::ClockMode::kLockStep)
    follower_.emplace(robots::makeRestFollower(setup.robot));
  else
    settler_ = std::make_unique<Settler>(setup);
}

void FrameLoop::start() {
  if (settler_)
    settler_->start();
}

void FrameLoop::stop() {
  if (settler_)
    settler_->stop();
}

void FrameLoop::restart() noexcept {
  ++placement_;
  if (follower_)
    follower_.emplace(robots::makeRestFollower(setup_.robot));
}

void FrameLoop::stepAtOnce(const safety::RobotVector& q,
                           const planning::Reference& tasks,
                           planning::ReferenceTracker& tracker,
                           planning::TrackResult& result) {
  const auto settle = [this](const safety::RobotVector& joints) { return follower_->settle(joints); };
  const std::string why =
      robots::stepByMiddle(follower_->mechanism(), settle, tracker, q, tasks.frame, period_, rest_, result);
  if (why.empty())
    return;
  spdlog::error("no rest at the present joints: {}", why);
  tracker.hold(q, q, TrackStatus::kModel, result);
}

dds::HoldReason FrameLoop::step(std::int64_t now,
                                const safety::RobotVector& setpoint,
                                const safety::RobotVector& velocity,
                                const planning::Reference& tasks,
                                planning::ReferenceTracker& tracker,
                                planning::TrackResult& result) noexcept {
  if (tasks.task_count != 1 || tasks.tasks[0].kind != planning::TaskKind::kFrame) {
    tracker.hold(setpoint, setpoint, TrackStatus::kReference, result);
    return dds::HoldReason::kNone;
  }
  if (follower_) {
    stepAtOnce(setpoint, tasks, tracker, result);
    return dds::HoldReason::kNone;
  }
  settler_->take(answer_);
  const double age = 1e-9 * static_cast<double>(now - answer_.stamp);
  if (!answer_.rest.known() || answer_.placement != placement_ || age > oldest_) {
    tracker.hold(setpoint, setpoint, TrackStatus::kRest, result);
    return dds::HoldReason::kNoRest;
  }
  const safety::RobotVector middle = tracker.moved(setpoint, 0.5 * period_ * velocity);
  tracker.step(answer_.rest, middle, setpoint, tasks.frame.after(0.5 * period_), result);
  return dds::HoldReason::kNone;
}

void FrameLoop::ask(std::int64_t now,
                    const safety::RobotVector& setpoint,
                    const safety::RobotVector& velocity,
                    const planning::ReferenceTracker& tracker) noexcept {
  if (!settler_)
    return;
  wish_.stamp = now;
  wish_.placement = placement_;
  wish_.joint_count = static_cast<int>(setpoint.size());
  Eigen::VectorXd::Map(wish_.joints.data(), setpoint.size()) = tracker.moved(setpoint, 1.5 * period_ * velocity);
  settler_->ask(wish_);
}

}  // namespace tandem::service
