// SPDX-License-Identifier: Apache-2.0
#include "planning/teleoperation/pipeline.h"

#include <algorithm>

namespace tandem::planning::teleoperation {
namespace {

using Eigen::Vector3d;

constexpr std::array<std::string_view, kStages> kStageNames{"deadband", "dead_man", "clutch",    "frame", "scale",
                                                            "filter",   "fixture",  "workspace", "rate",  "reach"};

/// Part of a vector outside of a ball.
Vector3d outside(const Vector3d& v, double radius) noexcept {
  const double norm = v.norm();
  return norm <= radius ? Vector3d(Vector3d::Zero()) : Vector3d((1.0 - radius / norm) * v);
}

}  // namespace

std::string_view name(Stage stage) { return kStageNames[static_cast<std::size_t>(stage)]; }

Pipeline::Pipeline(const Options& options, double period)
    : options_(&options),
      period_(period),
      response_(responseTime(options.guard, period)),
      leash_(leashOf(options.guard, period)),
      filter_(options.filter),
      guard_(options.guard),
      scale_(options.scale) {}

void Pipeline::pass(Stage stage, const Vector3d& in, const Vector3d& out, Limiter limiter) noexcept {
  stages_[static_cast<std::size_t>(stage)] = {in, out, in == out ? Limiter::kNone : limiter, 0};
}

void Pipeline::release() noexcept {
  engaged_ = false;
  state_ = State::kReleased;
}

void Pipeline::engage(const Sample& sample, const TipPlaces& tips) noexcept {
  engaged_ = true;
  placed_ = false;
  number_ = 0;
  mode_ = sample.mode;
  arm_ = sample.arm;
  other_arm_ = sample.other_arm;
  const Vector3d& tip = tips[static_cast<std::size_t>(arm_)];
  const Vector3d& other = tips[static_cast<std::size_t>(other_arm_)];
  held_ = mode_ == Mode::kPair ? Vector3d(tip - other) : other;
  now_ = mode_ == Mode::kRelative ? Vector3d(tip - other) : tip;
  raw_ = now_;
  filter_.reset(now_);
  guard_.engage(now_);
}

double Pipeline::lag() const noexcept {
  constexpr double kStanding = 1e-5;  // m/s
  return engaged_ && target_speed_ > kStanding ? (guard_.target() - now_).norm() / target_speed_ : 0.0;
}

/// Device velocity over this cycle. For positions: motion since the last one; the first one only sets the origin.
Vector3d Pipeline::deviceVelocity(const Sample& sample) noexcept {
  const bool fresh = sample.number != number_;
  number_ = sample.number;
  if (!sample.pose) {
    placed_ = false;
    const Vector3d v = outside(sample.value, options_->deadband_speed);
    pass(Stage::kDeadband, sample.value, v, Limiter::kDeadband);
    return v;
  }
  Vector3d moved = Vector3d::Zero(), all = Vector3d::Zero();
  if (fresh && placed_) {
    all = sample.value - last_place_;
    moved = outside(all, options_->deadband_distance);
    last_place_ += moved;
  } else if (fresh) {
    last_place_ = sample.value;
    placed_ = true;
  }
  pass(Stage::kDeadband, all / period_, moved / period_, Limiter::kDeadband);
  return moved / period_;
}

DrivenTips Pipeline::drivenTips(const TipPlaces& tips) const noexcept {
  DrivenTips moved;
  const Vector3d& tip = tips[static_cast<std::size_t>(arm_)];
  moved.add(arm_, mode_ == Mode::kRelative ? held_ : Vector3d(Vector3d::Zero()), tip);
  if (mode_ == Mode::kPair)
    moved.add(other_arm_, -held_, tips[static_cast<std::size_t>(other_arm_)]);
  return moved;
}

State Pipeline::step(const Sample& sample, const TipPlaces& tips) noexcept {
  const bool other_way = sample.mode != mode_ || sample.arm != arm_ || sample.other_arm != other_arm_;
  if (engaged_ && (!sample.present || other_way))
    release();
  if (sample.present && !engaged_)
    engage(sample, tips);

  const Vector3d said = deviceVelocity(sample);
  const Vector3d allowed = sample.present ? said : Vector3d(Vector3d::Zero());
  pass(Stage::kDeadMan, said, allowed, Limiter::kDeadMan);
  const Vector3d free = sample.clutch ? Vector3d(Vector3d::Zero()) : allowed;
  pass(Stage::kClutch, allowed, free, Limiter::kClutch);
  const Vector3d turned = sample.frame * free;
  pass(Stage::kFrame, free, turned, Limiter::kNone);
  const double asked = sample.scale > 0.0 ? std::clamp(sample.scale, kMinScale, kMaxScale) : options_->scale;
  scale_ += std::clamp(asked - scale_, -options_->scale_rate * period_, options_->scale_rate * period_);
  const Vector3d scaled = scale_ * turned;
  pass(Stage::kScale, turned, scaled, Limiter::kScale);
  if (!engaged_) {
    for (std::size_t s = static_cast<std::size_t>(Stage::kFilter); s < kStages; ++s)
      stages_[s] = {};
    return state_ = State::kReleased;
  }

  const Vector3d& tip = tips[static_cast<std::size_t>(arm_)];
  now_ = mode_ == Mode::kRelative ? Vector3d(tip - tips[static_cast<std::size_t>(other_arm_)]) : tip;
  raw_ += period_ * scaled;
  if (sample.clutch) {  // motion still in the filter is discarded
    raw_ = guard_.target();
    filter_.reset(raw_);
  }
  wanted_ = filter_.step(raw_, period_);
  pass(Stage::kFilter, raw_, wanted_, Limiter::kNone);
  const Vector3d before = guard_.target();
  const TargetGuard::Result& result = guard_.step(wanted_, now_, drivenTips(tips), leash_, period_);
  target_speed_ = (guard_.target() - before).norm() / period_;
  stages_[static_cast<std::size_t>(Stage::kFixture)] = result.fixture;
  stages_[static_cast<std::size_t>(Stage::kWorkspace)] = result.workspace;
  stages_[static_cast<std::size_t>(Stage::kRate)] = result.rate;
  stages_[static_cast<std::size_t>(Stage::kReach)] = result.reach;
  // A device that sends velocities has no position: motion that was not allowed is discarded, so that reverse motion
  // starts at once. A device that sends positions keeps its position behind the bound.
  if (!sample.pose) {
    const Vector3d back = guard_.target() - wanted_;
    raw_ += back;
    filter_.shift(back);
  }
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
  const auto lead = [&](double gain) -> Vector3d {
    return std::max(0.0, 1.0 / response_ - gain) * (guard_.target() - now_);
  };
  switch (mode_) {
    case Mode::kTip:
      add(TaskKind::kTipPosition, arm_, guard_.target()).feed_forward = lead(tip_gain);
      if (other_arm_ != arm_)
        add(TaskKind::kTipPosition, other_arm_, held_);
      break;
    case Mode::kPair:
      add(TaskKind::kRelativePosition, arm_, held_);
      add(TaskKind::kTipPosition, arm_, guard_.target()).feed_forward = lead(tip_gain);
      break;
    case Mode::kRelative:
      add(TaskKind::kRelativePosition, arm_, guard_.target()).feed_forward = lead(relative_gain);
      add(TaskKind::kTipPosition, other_arm_, held_);
      break;
    case Mode::kNone:
      break;
  }
}

}  // namespace tandem::planning::teleoperation
