// SPDX-License-Identifier: Apache-2.0
#include "hal/homing_run.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::hal {
namespace {

/// An axis in a homing run must have no guard.
bool bad(const Axis& axis) { return axis.guards() != 0 || axis.phase() == AxisPhase::kFailed; }

bool unhomed(const Axis& axis) { return axis.phase() == AxisPhase::kUnhomed; }

bool hasStop(const Axis& axis) { return axis.config().reference == PositionReference::kHardStop; }

}  // namespace

HomingRun::HomingRun(std::vector<Axis*> axes, double period) : axes_(std::move(axes)) {
  for (const Axis* axis : axes_)
    searches_.emplace_back(axis->config(), period);
}

bool HomingRun::needed() const noexcept {
  return std::any_of(axes_.begin(), axes_.end(), [](const Axis* a) { return unhomed(*a); });
}

bool HomingRun::member(const Axis& axis) const noexcept {
  return axis.config().needsRun() && axis.config().homing.order == order_;
}

template <class Condition>
bool HomingRun::all(Condition&& condition) const noexcept {
  return std::all_of(axes_.begin(), axes_.end(), [&](Axis* axis) { return !member(*axis) || condition(*axis); });
}

bool HomingRun::anyBad() const noexcept {
  return !all([](const Axis& axis) { return !bad(axis); });
}

void HomingRun::enter(Phase phase, std::int64_t now) noexcept {
  phase_ = phase;
  entered_ = now;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    if (member(*axes_[i]))
      enterOf(i, phase, now);
  }
}

void HomingRun::enterOf(std::size_t index, Phase phase, std::int64_t now) noexcept {
  Axis& axis = *axes_[index];
  switch (phase) {
    case Phase::kPrepare:
      axis.driver().prepare(hasStop(axis) ? DriveTask::kPush : DriveTask::kHome);
      break;
    case Phase::kPrepareBack:
      axis.driver().prepare(DriveTask::kFollow);
      break;
    case Phase::kPower:
      axis.hold();
      axis.setGoal(PowerGoal::kOperation, now);
      break;
    case Phase::kRun:
      start(index, now);
      break;
    case Phase::kPowerOff:
      axis.endRun();
      axis.driver().endHoming();
      axis.setGoal(PowerGoal::kOff, now);
      break;
    case Phase::kLimits:
      axis.rereference(hasStop(axis) ? axis.placeOf(searches_[index].contact()) : 0.0, axis.config().homing.position);
      break;
    case Phase::kAborting:
      axis.endRun();
      axis.setGoal(PowerGoal::kOff, now);
      break;
    case Phase::kIdle:
      break;
  }
}

void HomingRun::start(std::size_t index, std::int64_t now) noexcept {
  Axis& axis = *axes_[index];
  const AxisConfig& config = axis.config();
  if (hasStop(axis)) {
    const double velocity = config.hard_stop.positive ? config.hard_stop.speed : -config.hard_stop.speed;
    axis.countFromHere();
    axis.beginRun(std::min(velocity, 0.0), std::max(velocity, 0.0), now);
    searches_[index].start(now);
  } else {
    const double fastest = std::max(config.homing.fast, config.homing.slow);
    axis.beginRun(-fastest, fastest, now);
    axis.driver().startHoming();
  }
}

void HomingRun::nextGroup(std::int64_t now) noexcept {
  constexpr int kNone = std::numeric_limits<int>::max();
  order_ = kNone;
  budget_ = 0.0;
  for (const Axis* axis : axes_) {
    if (unhomed(*axis))
      order_ = std::min(order_, axis->config().homing.order);
  }
  for (const Axis* axis : axes_) {
    if (member(*axis))
      budget_ = std::max(budget_, axis->config().homing.budget);
  }
  enter(order_ == kNone ? Phase::kIdle : Phase::kPrepare, now);
}

void HomingRun::start(std::int64_t now) noexcept {
  if (!running())
    nextGroup(now);
}

void HomingRun::abort(std::int64_t now) noexcept {
  if (running() && phase_ != Phase::kAborting)
    enter(Phase::kAborting, now);
}

void HomingRun::stepPrepare(Phase next, std::int64_t now) noexcept {
  bool done = true;
  for (Axis* axis : axes_) {
    if (!member(*axis))
      continue;
    const Progress progress = axis->driver().prepared();
    if (progress == Progress::kFailed)
      axis->failHoming(HomingFailure::kSetup);
    done = done && progress == Progress::kDone;
  }
  if (done)
    enter(next, now);
}

void HomingRun::stepRun(std::int64_t now) noexcept {
  const bool late = 1e-9 * static_cast<double>(now - entered_) > budget_;
  // What the drive reports of its run is valid only after it has processed the start, not in the first cycles.
  constexpr std::int64_t kSettling = 50'000'000;  // ns
  if (now - entered_ < kSettling)
    return;
  bool done = true;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    Axis& axis = *axes_[i];
    if (!member(axis))
      continue;
    hasStop(axis) ? stepStop(i, late, now) : stepDrive(axis, late);
    done = done && (hasStop(axis) ? searches_[i].found() : axis.driver().homing() == Progress::kDone);
  }
  if (done)
    enter(Phase::kPowerOff, now);
}

void HomingRun::stepDrive(Axis& axis, bool late) noexcept {
  const Progress progress = axis.driver().homing();
  if (progress == Progress::kFailed)
    axis.failHoming(HomingFailure::kDrive);
  else if (axis.driveState() != DriveState::kOperationEnabled)
    axis.failHoming(HomingFailure::kPowerOff);
  else if (late && progress != Progress::kDone)
    axis.failHoming(HomingFailure::kLate);
}

void HomingRun::stepStop(std::size_t index, bool late, std::int64_t now) noexcept {
  Axis& axis = *axes_[index];
  HardStopSearch& search = searches_[index];
  search.step(axis.position(), axis.torque(), now);
  axis.setTarget(search.target(), search.velocity());
  if (search.lost())
    axis.failHoming(HomingFailure::kNoStop);
  else if (axis.driveState() != DriveState::kOperationEnabled)
    axis.failHoming(HomingFailure::kPowerOff);
  else if (late && !search.found())
    axis.failHoming(HomingFailure::kLate);
}

void HomingRun::step(std::int64_t now) noexcept {
  if (!running())
    return;
  if (phase_ == Phase::kAborting) {
    if (all([&](const Axis& axis) { return axis.goalReached() || axis.goalLate(now); })) {
      for (Axis* axis : axes_) {
        if (member(*axis))
          axis->driver().endHoming();
      }
      phase_ = Phase::kIdle;
    }
    return;
  }
  if (anyBad())
    return abort(now);
  switch (phase_) {
    case Phase::kPrepare:
      return stepPrepare(Phase::kPower, now);
    case Phase::kPower:
      for (Axis* axis : axes_) {
        if (member(*axis) && axis->goalLate(now))
          axis->fail(HardwareGuard::kSwitchOn);
      }
      if (all([](const Axis& axis) { return axis.operates(); }))
        enter(Phase::kRun, now);
      return;
    case Phase::kRun:
      return stepRun(now);
    case Phase::kPowerOff:
      if (all([](const Axis& axis) { return axis.goalReached(); }))
        enter(Phase::kPrepareBack, now);
      return;
    case Phase::kPrepareBack:
      return stepPrepare(Phase::kLimits, now);
    case Phase::kLimits:
      if (all([](const Axis& axis) { return axis.phase() == AxisPhase::kReady; }))
        nextGroup(now);
      return;
    default:
      return;
  }
}

}  // namespace tandem::hal
