// SPDX-License-Identifier: Apache-2.0
#include "safety/operating_state.h"

namespace tandem::safety {
std::optional<OperatingState> transition(OperatingState state, StateCommand command) {
  using State = OperatingState;
  if (command == StateCommand::kRecover)
    return state == State::kDisabled || state == State::kFault ? std::optional(State::kEnabled) : std::nullopt;
  if (state == State::kFault) {
    // The deviation from CRTK: besides `recover`, only `disable` leaves FAULT.
    return command == StateCommand::kDisable ? std::optional(State::kDisabled) : std::nullopt;
  }
  switch (command) {
    case StateCommand::kEnable:
      return state == State::kPaused ? std::nullopt : std::optional(State::kEnabled);
    case StateCommand::kDisable:
      return State::kDisabled;
    case StateCommand::kPause:
      return state == State::kDisabled ? std::nullopt : std::optional(State::kPaused);
    case StateCommand::kResume:
      return state == State::kPaused ? std::optional(State::kEnabled) : std::nullopt;
    case StateCommand::kHome:
      return state == State::kEnabled ? std::optional(state) : std::nullopt;
    case StateCommand::kUnhome:
      return state;
    case StateCommand::kRecover:
      break;
  }
  return std::nullopt;
}

bool StateMachine::command(StateCommand command, FaultMask present) {
  const std::optional<OperatingState> next = transition(state_, command);
  if (!next)
    return false;
  if (state_ == OperatingState::kFault) {
    faults_ = present;  // clears all faults without a present cause
    if (faults_ != 0)
      return false;
  }
  // No power and no motion while a fault is present.
  if (*next == OperatingState::kEnabled && present != 0)
    return false;
  state_ = *next;
  return true;
}

void StateMachine::latch(FaultMask faults) {
  if (faults == 0)
    return;
  faults_ |= faults;
  state_ = OperatingState::kFault;
}

}  // namespace tandem::safety
