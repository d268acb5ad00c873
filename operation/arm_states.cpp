// SPDX-License-Identifier: Apache-2.0
#include "operation/arm_states.h"

#include <utility>

namespace tandem::operation {

using safety::DriveRequest;
using safety::Fault;
using safety::FaultCause;
using safety::OperatingState;
using safety::StateCommand;

void ArmStates::onState(bool restarted) noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    // Motion does not continue after a restart of the drives.
    if (restarted && at(k).machine.state() != OperatingState::kDisabled)
      latch(k, {bit(Fault::kDrive), FaultCause::kRestarted});
    compare(k);
  }
}

void ArmStates::compare(int k) noexcept {
  Arm& arm = at(k);
  const msg::ActuationState& state = drives_.state();
  const auto i = static_cast<std::size_t>(k);
  // Until the drives recover an arm, they report the faults that it is recovered from.
  const bool knows = !(arm.pending && arm.recovering);
  if (knows && state.faults[i] != 0 && state.answers_command >= arm.ignored_until)
    latch(k, {state.faults[i], FaultCause::kReported});
  if (knows && state.valid[i] == 0 && arm.machine.mayMove())
    latch(k, {bit(Fault::kSensor)});
  const bool as_asked = !(arm.pending && arm.recovering) || state.recovery[i] != 0;
  if (drives_.state(k) == OperatingState::kEnabled && arm.machine.mayMove() && as_asked) {
    // Drives that have not received the request may be entering the state of the previous request.
    arm.pending = arm.pending && state.answers_command < arm.power_command;
  } else if (arm.machine.mayMove() && !arm.pending) {
    latch(k, {bit(Fault::kDrive), FaultCause::kLeftEnabled});
  }
}

void ArmStates::apply(StateCommand command, int k, safety::JointMask without, std::int64_t now) noexcept {
  constexpr std::int64_t kTimeout = 8'000'000'000;  // ns: limits are written, drives get power
  Arm& arm = at(k);
  arm.machine.command(command);
  if (arm.machine.faults() == 0)
    reported_faults_.forget(k);
  switch (command) {
    case StateCommand::kRecover:
      arm.record = {};
      arm.without = without;
      [[fallthrough]];
    case StateCommand::kEnable:
    case StateCommand::kResume:
      if (command != StateCommand::kResume)
        arm.recovering = command == StateCommand::kRecover;
      arm.together = 0;
      arm.pending = true;
      arm.pending_until = now + kTimeout;
      arm.power_command = drives_.sequence() + 1;
      break;
    case StateCommand::kDisable:
      arm.ignored_until = drives_.sequence() + 1;
      arm.record = {};
      arm.pending = false;
      break;
    case StateCommand::kPause:
      arm.pending = false;
      break;
    case StateCommand::kHome:
    case StateCommand::kUnhome:
      break;
  }
}

void ArmStates::latch(int k, const safety::FaultRecord& record) noexcept {
  if (at(k).machine.state() != OperatingState::kFault)
    at(k).record = record;
  at(k).machine.latch(record.faults);
}

void ArmStates::stop() noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    latch(k, {bit(Fault::kStopRequested)});
    reported_faults_.forget(k);
  }
}

void ArmStates::enabledTogether(int first, int last) noexcept {
  unsigned arms = 0;
  for (int k = first; k <= last; ++k)
    arms |= drives_.state(k) != OperatingState::kEnabled ? 1U << k : 0U;
  for (int k = first; k <= last; ++k)
    at(k).together = arms;
}

void ArmStates::resolveGroupEnable() noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    if (!at(k).pending || at(k).machine.state() != OperatingState::kFault)
      continue;
    const unsigned together = std::exchange(at(k).together, 0U);
    for (int other = 0; other < arm_count_; ++other) {
      if ((together >> other & 1U) != 0 && mayMove(other))
        apply(StateCommand::kDisable, other, 0, 0);
    }
  }
}

void ArmStates::latchMoving(const safety::FaultRecord& record) noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    if (mayMove(k))
      latch(k, record);
  }
}

void ArmStates::giveUpPending(std::int64_t now) noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    if (at(k).pending && now > at(k).pending_until)
      latch(k, {bit(Fault::kDrive), FaultCause::kOff});
  }
}

void ArmStates::watchIdle(bool commanded,
                          std::int64_t now,
                          std::array<safety::IdlePower::Decision, safety::kMaxArms>& decisions) noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const bool powered = safety::hasPower(at(k).machine.state());
    decisions[i] = idle_.step(k, powered, commanded, drives_.state().holds[i] != 0, now);
    if (decisions[i] == safety::IdlePower::Decision::kPowerOff)
      apply(StateCommand::kDisable, k, 0, now);
  }
}

bool ArmStates::anyWithoutPower() const noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    const OperatingState state = at(k).machine.state();
    if (state == OperatingState::kDisabled || state == OperatingState::kFault)
      return true;
  }
  return false;
}

bool ArmStates::recovering(int k) const noexcept {
  const OperatingState state = at(k).machine.state();
  const bool requested = at(k).recovering && state != OperatingState::kDisabled && state != OperatingState::kFault;
  return requested || drives_.state().recovery[static_cast<std::size_t>(k)] != 0;
}

OperatingState ArmStates::shown(int k) const noexcept {
  const OperatingState wanted = at(k).machine.state();
  return wanted == OperatingState::kFault || !drives_.received() ? wanted : drives_.state(k);
}

DriveRequest ArmStates::requestFor(int k) const noexcept {
  const Arm& arm = at(k);
  const OperatingState drive = drives_.state(k);
  const bool power = safety::hasPower(drive);
  switch (arm.machine.state()) {
    case OperatingState::kEnabled:
      if (!arm.pending)
        return DriveRequest::kKeep;
      if (arm.recovering && drives_.state().recovery[static_cast<std::size_t>(k)] == 0 && power)
        return DriveRequest::kDisable;  // power was given for something other than recovery
      if (drive == OperatingState::kPaused)
        return DriveRequest::kResume;
      return arm.recovering ? DriveRequest::kRecover : DriveRequest::kEnable;
    case OperatingState::kPaused:
      return drive == OperatingState::kEnabled ? DriveRequest::kPause : DriveRequest::kKeep;
    case OperatingState::kFault:
      // Faults of the drives stay latched there until a disable request; faults of control end in a stop with power
      // off.
      return power ? DriveRequest::kDisable : DriveRequest::kKeep;
    case OperatingState::kDisabled:
      return drive == OperatingState::kDisabled ? DriveRequest::kKeep : DriveRequest::kDisable;
  }
  return DriveRequest::kKeep;
}

bool ArmStates::hasPendingDriveRequest() const noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    if (requestFor(k) != DriveRequest::kKeep)
      return true;
  }
  return false;
}

void ArmStates::fill(int k, ArmCondition& condition) const noexcept {
  const auto i = static_cast<std::size_t>(k);
  condition.wanted = at(k).machine.state();
  condition.drives = drives_.state(k);
  condition.pending = at(k).pending;
  condition.valid = drives_.state().valid[i] != 0;
  condition.located = drives_.state().homed[i] != 0;
  condition.recovering = recovering(k);
}

void ArmStates::fill(msg::ActuationCommand& command) const noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    command.request[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(requestFor(k));
    command.without[static_cast<std::size_t>(k)] = at(k).without;
  }
}

void ArmStates::fill(msg::ControlStatus& status) noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    reported_faults_.record(k, at(k).machine.faults(), status.sequence);
    status.operating_state[i] = static_cast<std::uint8_t>(shown(k));
    status.recovery[i] = recovering(k) ? 1 : 0;
    status.busy[i] = at(k).pending ? 1 : 0;
    status.faults[i] = at(k).machine.faults();
    status.idle[i] = idle_.idle(k);
    status.idle_left[i] = idle_.left(k);
  }
}

}  // namespace tandem::operation
