// SPDX-License-Identifier: Apache-2.0
#include "safety/arm_supervisor.h"

#include <algorithm>
#include <cmath>

namespace tandem::safety {
namespace {

/// Sums of periods differ from their multiples by rounding; this share of a segment is not worth another step.
constexpr double kTimeTolerance = 1e-9;
constexpr double kNoWay = 1e-15;  ///< m, rad: rounding

}  // namespace

ArmSupervisor::ArmSupervisor(const ArmLimits& limits, const ArmVector& position, const SupervisorOptions& options)
    : gate_(limits), options_(options), watchdog_(options.budgets.commandAge(options.control_period)), limits_(limits) {
  place(position);
}

bool ArmSupervisor::powered() const noexcept { return hasPower(machine_.state()); }

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
  if (mode_ != Mode::kArrived)
    return;  // a segment under way is ended first: its setpoint has been promised
  if (options_.immediate_hold) {
    stand();
  } else {
    stop();
  }
}

void ArmSupervisor::latch(const FaultRecord& record) noexcept {
  if (record.faults == 0)
    return;
  // A lost joint may go on to say what is wrong with it; a stop, or a fault of another kind, is news.
  const bool news = machine_.state() != OperatingState::kFault || (record.faults & ~machine_.faults()) != 0;
  recover_consumed_ = recover_consumed_ || (recover_requested_ && news);
  if (machine_.state() != OperatingState::kFault)
    record_ = record;
  machine_.latch(record.faults);
  stop();
}

void ArmSupervisor::latchAxisFailure(const FaultRecord& record, double position) noexcept {
  reference_[record.joint] = position;
  velocity_[record.joint] = 0.0;
  if (mode_ == Mode::kStanding)
    stand();
  latch(record);
}

FaultRecord ArmSupervisor::recordOf(const GateReport& report) const noexcept {
  FaultRecord record;
  record.faults = report.faults;
  if (report.faults & bit(Fault::kNotFinite))
    record.joint = static_cast<std::uint8_t>(report[Guard::kFinite].joint);
  if (report.faults & bit(Fault::kStepTooLarge)) {
    const GuardAction& action = report[Guard::kStep];
    record.joint = static_cast<std::uint8_t>(action.joint);
    record.allowed = gate_.limits().joints[static_cast<std::size_t>(action.joint)].max_step;
    record.amount = record.allowed + action.amount;
  }
  if ((report.faults & bit(Fault::kStaleCommand)) && report[Guard::kFresh].amount > 0.0) {
    record.allowed = options_.budgets.commandAge(options_.control_period);
    record.amount = record.allowed + report[Guard::kFresh].amount;
  }
  return record;
}

void ArmSupervisor::disableForNewSession() noexcept {
  if (powered())
    machine_.command(StateCommand::kDisable);
  stop();
}

void ArmSupervisor::enable(const ArmVector& measured, const FaultRecord& present) noexcept {
  if (machine_.state() == OperatingState::kFault || !standing())
    return;
  if (present.faults != 0) {
    latch(present);  // says why the arm cannot be enabled
    return;
  }
  if (const LimitViolation outside = readOutside(limits_, measured); !(outside.amount <= 0.0)) {
    latch({bit(Fault::kDrive), FaultCause::kOutsideLimits, static_cast<std::uint8_t>(outside.joint), outside.amount,
           0.0});
    return;
  }
  if (!machine_.command(StateCommand::kEnable))
    return;
  setSpeeds(false, 0);
  place(firstSetpoint(measured));
}

/// The measured position; where the error of the readings alone puts it outside the limits, the nearest one inside.
ArmVector ArmSupervisor::firstSetpoint(const ArmVector& measured) const noexcept {
  const ArmVector inside = broughtInside(limits_, measured);
  for (int j = 0; j < limits_.jointCount(); ++j) {
    if (std::abs(inside[j] - measured[j]) > limits_.joints[static_cast<std::size_t>(j)].reading_error)
      return measured;
  }
  return inside;
}

void ArmSupervisor::recover(const ArmVector& measured, JointMask lost) noexcept {
  if (powered() || !standing() || !measured.allFinite())
    return;
  if (!machine_.command(StateCommand::kRecover))
    return;
  record_ = {};
  recover_consumed_ = true;
  setSpeeds(true, lost);
  place(measured);
}

void ArmSupervisor::setSpeeds(bool recovering, JointMask lost) noexcept {
  recovering_ = recovering;
  lost_ = lost;
  for (int j = 0; j < limits_.jointCount(); ++j)
    gate_.setVelocity(
        j, recovering ? recoveryVelocity(limits_, lost, j) : limits_.joints[static_cast<std::size_t>(j)].velocity);
}

void ArmSupervisor::applyRequest(const ArmRequest& request,
                                 const ArmVector& measured,
                                 const FaultRecord& present) noexcept {
  switch (request.request) {
    case DriveRequest::kKeep:
      return;
    case DriveRequest::kEnable:
      if (machine_.state() == OperatingState::kDisabled)
        enable(measured, present);
      return;
    case DriveRequest::kDisable:
      if (machine_.command(StateCommand::kDisable, present.faults)) {
        record_ = {};
        stop();
      } else if (machine_.state() == OperatingState::kFault) {
        record_ = present;  // the cause that stands is all that is left
      }
      return;
    case DriveRequest::kPause:
      if (machine_.command(StateCommand::kPause))
        stop();
      return;
    case DriveRequest::kResume:
      machine_.command(StateCommand::kResume, present.faults);
      return;
    case DriveRequest::kRecover:
      if (present.faults == 0 && !recover_consumed_ && !request.unseen)
        recover(measured, request.lost);
      return;
  }
}

GateReport ArmSupervisor::command(const ArmRequest& request,
                                  const ArmVector& measured,
                                  const FaultRecord& present,
                                  std::int64_t now) noexcept {
  GateReport report;
  const bool was_enabled = machine_.mayMove();
  if (request.motion.stream == 0) {
    watchdog_.feed(now);
    applyRequest(request, measured, present);
  }
  // What was computed before the arm was enabled or resumed does not move it.
  const bool moves = request.moving && was_enabled && machine_.mayMove();
  if (request.motion.stream != 0 || moves) {
    GateCommand motion = request.motion;
    motion.duration = options_.control_period;
    if (motion.position.allFinite() && motion.velocity.size() == reference_.size())
      motion.position = setpoint() + motion.duration * motion.velocity;
    ArmVector next;
    report = gate_.check(motion, setpoint(), commanded_speed_, next);
    if (report.faults == 0) {
      move(next);
    } else if (powered()) {
      latch(recordOf(report));
    }
  } else if (machine_.mayMove()) {
    hold();
  }
  return report;
}

/** The part of the way from the reference to `next` that one period allows: no joint is led farther than it was asked
 * to go in this period, or goes already. Commands that come more often than agreed would add up otherwise: the arm
 * would move faster than was asked, and go on when they end. A part of a straight way between two places inside boxes
 * and rows stays inside them. */
ArmVector ArmSupervisor::withinOnePeriod(const ArmVector& next) const noexcept {
  double part = 1.0;
  for (Eigen::Index j = 0; j < next.size(); ++j) {
    const double asked = std::abs(next[j] - setpoint()[j]);
    const double allowed = std::max(asked, options_.control_period * std::abs(velocity_[j]));
    const double distance = std::abs(next[j] - reference_[j]);
    if (distance > allowed * (1.0 + kTimeTolerance) + kNoWay)
      part = std::min(part, allowed / distance);
  }
  return part < 1.0 ? ArmVector(reference_ + part * (next - reference_)) : next;
}

void ArmSupervisor::move(const ArmVector& setpoint) noexcept {
  const ArmVector target = withinOnePeriod(setpoint);
  commanded_speed_ = (target - this->setpoint()) / options_.control_period;
  start_ = reference_;
  target_ = target;
  elapsed_ = 0.0;
  velocity_ = (target_ - start_) / options_.control_period;
  mode_ = Mode::kSegment;
}

/// Returns the time that is left over when the segment ends, s; negative while it goes on.
double ArmSupervisor::advanceSegment(double dt) noexcept {
  const double duration = options_.control_period;
  elapsed_ += dt;
  const double left_over = elapsed_ - duration;
  if (left_over < -kTimeTolerance * duration) {
    reference_ = start_ + (elapsed_ / duration) * (target_ - start_);
    return -1.0;
  }
  reference_ = target_;
  mode_ = Mode::kArrived;
  if (velocity_.isZero(0.0))
    stand();
  return left_over > kTimeTolerance * duration ? left_over : 0.0;
}

void ArmSupervisor::step(double dt, std::int64_t now) noexcept {
  if (machine_.mayMove() && watchdog_.expired(now)) {
    latch({bit(Fault::kCommandTimeout), FaultCause::kUnspecified, idl::kNoJoint, watchdog_.silence(now),
           options_.budgets.commandAge(options_.control_period)});
  }
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
