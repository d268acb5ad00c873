// SPDX-License-Identifier: Apache-2.0
#include "safety/arm_supervisor.h"

#include <algorithm>
#include <cmath>

namespace tandem::safety {
namespace {

/// Sums of periods differ from their multiples by rounding; this share of a segment is not worth another step.
constexpr double kTimeTolerance = 1e-9;

}  // namespace

ArmSupervisor::ArmSupervisor(const ArmLimits& limits, const ArmVector& position, const SupervisorOptions& options)
    : gate_(limits), options_(options), watchdog_(options.budgets.commandAge(options.control_period)) {
  place(position);
}

bool ArmSupervisor::powered() const noexcept {
  return machine_.state() == OperatingState::kEnabled || machine_.state() == OperatingState::kPaused;
}

void ArmSupervisor::place(const ArmVector& position) noexcept {
  reference_ = position;
  stand();
}

void ArmSupervisor::stand() noexcept {
  mode_ = Mode::kStanding;
  velocity_.setZero(reference_.size());
  commanded_speed_.setZero(reference_.size());
  target_ = reference_;
}

void ArmSupervisor::stop() noexcept {
  if (mode_ == Mode::kStanding)
    return;
  ramp_.start(gate_.limits(), reference_, velocity_);
  mode_ = Mode::kRamp;
  if (ramp_.standing())
    stand();
}

void ArmSupervisor::hold() noexcept {
  if (mode_ == Mode::kRamp)
    return;
  if (options_.immediate_hold && mode_ == Mode::kArrived) {
    stand();
  } else {
    stop();
  }
}

void ArmSupervisor::latch(FaultMask faults) noexcept {
  if (faults == 0)
    return;
  machine_.latch(faults);
  stop();
}

void ArmSupervisor::latchAxisFailure(int joint, double position) noexcept {
  reference_[joint] = position;
  velocity_[joint] = 0.0;
  if (mode_ == Mode::kStanding)
    stand();
  latch(bit(Fault::kDrive));
}

void ArmSupervisor::disableForNewSession() noexcept {
  if (powered())
    machine_.command(StateCommand::kDisable);
  stop();
}

void ArmSupervisor::enable(const ArmVector& measured, FaultMask present) noexcept {
  if (machine_.state() == OperatingState::kFault || !standing())
    return;
  if (present != 0) {
    machine_.latch(present);  // says why the arm cannot be enabled
    return;
  }
  if (machine_.command(StateCommand::kEnable))
    place(measured);
}

void ArmSupervisor::applyRequest(DriveRequest request, const ArmVector& measured, FaultMask present) noexcept {
  switch (request) {
    case DriveRequest::kKeep:
      return;
    case DriveRequest::kEnable:
      if (machine_.state() == OperatingState::kDisabled)
        enable(measured, present);
      return;
    case DriveRequest::kDisable:
      if (machine_.command(StateCommand::kDisable, present))
        stop();
      return;
    case DriveRequest::kPause:
      if (machine_.command(StateCommand::kPause))
        stop();
      return;
    case DriveRequest::kResume:
      machine_.command(StateCommand::kResume, present);
      return;
  }
}

GateReport ArmSupervisor::command(const ArmRequest& request,
                                  const ArmVector& measured,
                                  FaultMask present,
                                  std::int64_t now) noexcept {
  GateReport report;
  const bool was_enabled = machine_.mayMove();
  if (request.motion.stream == 0) {
    watchdog_.feed(now);
    applyRequest(request.request, measured, present);
  }
  // What was computed before the arm was enabled or resumed does not move it.
  const bool moves = request.moving && was_enabled && machine_.mayMove();
  if (request.motion.stream != 0 || moves) {
    GateCommand motion = request.motion;
    motion.duration = options_.control_period;
    ArmVector next;
    report = gate_.check(motion, setpoint(), commanded_speed_, next);
    if (report.faults == 0) {
      move(next);
    } else if (powered()) {
      latch(report.faults);
    }
  } else if (machine_.mayMove()) {
    hold();
  }
  return report;
}

void ArmSupervisor::move(const ArmVector& setpoint) noexcept {
  commanded_speed_ = (setpoint - this->setpoint()) / options_.control_period;
  start_ = reference_;
  target_ = setpoint;
  elapsed_ = 0.0;
  duration_ = options_.control_period;
  for (Eigen::Index j = 0; j < target_.size(); ++j) {
    // A command that comes early finds the last setpoint still ahead: take longer rather than move faster than allowed.
    const double needed = std::abs(target_[j] - start_[j]) / gate_.limits().joints[j].velocity;
    if (needed > duration_ * (1.0 + kTimeTolerance))
      duration_ = needed;
  }
  velocity_ = (target_ - start_) / duration_;
  mode_ = Mode::kSegment;
}

/// Returns the time that is left over when the segment ends, s; negative while it goes on.
double ArmSupervisor::advanceSegment(double dt) noexcept {
  elapsed_ += dt;
  const double left_over = elapsed_ - duration_;
  if (left_over < -kTimeTolerance * duration_) {
    reference_ = start_ + (elapsed_ / duration_) * (target_ - start_);
    return -1.0;
  }
  reference_ = target_;
  mode_ = Mode::kArrived;
  if (velocity_.isZero(0.0))
    stand();
  return left_over > kTimeTolerance * duration_ ? left_over : 0.0;
}

void ArmSupervisor::step(double dt, std::int64_t now) noexcept {
  if (machine_.mayMove() && watchdog_.expired(now))
    latch(bit(Fault::kCommandTimeout));
  if (mode_ == Mode::kSegment) {
    dt = advanceSegment(dt);
    if (dt <= 0.0)
      return;
  }
  if (mode_ == Mode::kArrived)
    stop();
  if (mode_ == Mode::kRamp) {
    ramp_.step(dt, reference_, velocity_);
    commanded_speed_ = velocity_;
    if (ramp_.standing())
      stand();
  }
}

}  // namespace tandem::safety
