// SPDX-License-Identifier: Apache-2.0
#include "planning/teleoperation/pipeline.h"

#include <algorithm>

namespace tandem::planning::teleoperation {
namespace {

using Eigen::Vector3d;

constexpr std::array<std::string_view, kStages> kStageNames{"deadband", "dead_man", "clutch",    "frame", "scale",
                                                            "filter",   "fixture",  "workspace", "rate",  "reach"};

}  // namespace

std::string_view name(Stage stage) { return kStageNames[static_cast<std::size_t>(stage)]; }

Pipeline::Pipeline(const Options& options, double period)
    : options_(&options),
      period_(period),
      response_(responseTime(options.guard, period)),
      position_({options.deadband_speed, options.deadband_distance, options.filter, leashOf(options.guard, period)},
                TipRegions(options.guard),
                period),
      orientation_({options.rotation.deadband_speed,
                    options.rotation.deadband_angle,
                    {options.filter.min_cutoff, options.rotation.filter_beta, options.filter.derivative_cutoff},
                    angleLeashOf(options, period)},
                   FreeOrientations(options.rotation.space(), options.rotation.max_speed),
                   period),
      scale_(options.scale) {}

void Pipeline::release() noexcept {
  engaged_ = false;
  state_ = State::kReleased;
}

Vector3d Pipeline::driven(const TipPlaces& tips) const noexcept {
  const Vector3d& tip = tips[static_cast<std::size_t>(arm_)].position;
  return mode_ == Mode::kRelative ? Vector3d(tip - tips[static_cast<std::size_t>(other_arm_)].position) : tip;
}

void Pipeline::engage(const Sample& sample, const TipPlaces& tips) noexcept {
  engaged_ = true;
  number_ = 0;
  mode_ = sample.mode;
  arm_ = sample.arm;
  other_arm_ = sample.other_arm;
  const Vector3d& other = tips[static_cast<std::size_t>(other_arm_)].position;
  held_ = mode_ == Mode::kPair ? Vector3d(tips[static_cast<std::size_t>(arm_)].position - other) : other;
  position_.engage(driven(tips));
  orientation_.engage(tips[static_cast<std::size_t>(arm_)].orientation);
}

double Pipeline::lag() const noexcept {
  constexpr double kStanding = 1e-5;  // m/s
  const double speed = position_.targetSpeed();
  return engaged_ && speed > kStanding ? position_.ahead().norm() / speed : 0.0;
}

DrivenTips Pipeline::drivenTips(const TipPlaces& tips) const noexcept {
  DrivenTips moved;
  const Vector3d& tip = tips[static_cast<std::size_t>(arm_)].position;
  moved.add(arm_, mode_ == Mode::kRelative ? held_ : Vector3d(Vector3d::Zero()), tip);
  if (mode_ == Mode::kPair)
    moved.add(other_arm_, -held_, tips[static_cast<std::size_t>(other_arm_)].position);
  return moved;
}

/// The stages up to the scale. Rotations have a constant scale of their own.
void Pipeline::read(const Sample& sample) noexcept {
  const bool fresh = sample.number != number_;
  number_ = sample.number;
  const double asked = sample.scale > 0.0 ? std::clamp(sample.scale, kMinScale, kMaxScale) : options_->scale;
  scale_ += std::clamp(asked - scale_, -options_->scale_rate * period_, options_->scale_rate * period_);
  position_.read({fresh, sample.present, sample.clutch, sample.pose, sample.value, sample.value, sample.frame, scale_});
  if (rotates())
    orientation_.read({fresh, sample.present, sample.clutch, sample.pose, sample.angular, sample.orientation,
                       sample.frame, options_->rotation.scale});
}

State Pipeline::step(const Sample& sample, const TipPlaces& tips) noexcept {
  const bool other_way = sample.mode != mode_ || sample.arm != arm_ || sample.other_arm != other_arm_;
  if (engaged_ && (!sample.present || other_way))
    release();
  if (sample.present && !engaged_)
    engage(sample, tips);
  read(sample);
  if (!engaged_)
    return state_ = State::kReleased;
  position_.follow(driven(tips), drivenTips(tips));
  if (rotates())
    orientation_.follow(tips[static_cast<std::size_t>(arm_)].orientation, {});
  return state_ = sample.clutch ? State::kClutched : State::kFollowing;
}

void Pipeline::tasks(double relative_gain, double tip_gain, Reference& reference) const noexcept {
  reference.task_count = 0;
  reference.posture.resize(0);
  const auto add = [&](TaskKind kind, int arm, const Vector3d& position) -> TaskReference& {
    TaskReference& task = reference.tasks[static_cast<std::size_t>(reference.task_count++)];
    task = {kind, arm, other_arm_, position, Vector3d::Zero()};
    return task;
  };
  const auto lead = [&](double gain) -> Vector3d { return std::max(0.0, 1.0 / response_ - gain) * position_.ahead(); };
  switch (mode_) {
    case Mode::kTip:
      add(TaskKind::kTipPosition, arm_, position_.target()).feed_forward = lead(tip_gain);
      if (other_arm_ != arm_)
        add(TaskKind::kTipPosition, other_arm_, held_);
      break;
    case Mode::kPair:
      add(TaskKind::kRelativePosition, arm_, held_);
      add(TaskKind::kTipPosition, arm_, position_.target()).feed_forward = lead(tip_gain);
      break;
    case Mode::kRelative:
      add(TaskKind::kRelativePosition, arm_, position_.target()).feed_forward = lead(relative_gain);
      add(TaskKind::kTipPosition, other_arm_, held_);
      break;
    case Mode::kNone:
      return;
  }
  if (rotates()) {
    TaskReference& task = add(taskOf(options_->rotation.followed), arm_, Vector3d::Zero());
    task.orientation = orientation_.target();
    task.angular_feed_forward = std::max(0.0, 1.0 / response_ - tip_gain) * orientation_.ahead();
  }
}

}  // namespace tandem::planning::teleoperation
