// SPDX-License-Identifier: Apache-2.0
/** @file CRTK operating states and their transition table.
 *
 * Deliberate deviations from CRTK: in FAULT only `disable` and `recover` are accepted. `disable` clears a fault whose
 * cause is gone and leads to DISABLED; nothing moves until a new `enable` and a fresh stream. `recover`, from DISABLED
 * or FAULT, leads to ENABLED with the joints that still work: slow, inwards (safety/recovery.h). */
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "idl/enumerations.h"
#include "safety/faults.h"

namespace tandem::safety {

using idl::name;
using idl::OperatingState;
using idl::StateCommand;

/** State after a command; empty if the table forbids it. */
std::optional<OperatingState> transition(OperatingState state, StateCommand command);

/// Whether the drives of an arm in this state hold or move its joints.
constexpr bool hasPower(OperatingState state) {
  return state == OperatingState::kEnabled || state == OperatingState::kPaused;
}

/** Operating state of one arm with its latched faults. */
class StateMachine {
 public:
  OperatingState state() const { return state_; }
  FaultMask faults() const { return faults_; }
  bool mayMove() const { return state_ == OperatingState::kEnabled; }

  /// Applies a command; `present` are the faults whose cause is still present (they keep FAULT on `disable`). @return
  /// false if the table forbids the command, or a cause is still present.
  bool command(StateCommand command, FaultMask present = 0);

  /// Latches faults; any of them leads to FAULT.
  void latch(FaultMask faults);

 private:
  OperatingState state_ = OperatingState::kDisabled;
  FaultMask faults_ = 0;
};

}  // namespace tandem::safety
