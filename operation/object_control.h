// SPDX-License-Identifier: Apache-2.0
/** @file Interface of closed-loop control of a common object. */
#pragma once

#include "idl/messages.h"
#include "planning/reference_tracker.h"

namespace tandem::operation {

/** Called from the periodic thread; whoever implements it may have a thread beside it. */
class ObjectControl {
 public:
  virtual ~ObjectControl() = default;

  /// The joints were put elsewhere without a path.
  virtual void restart() noexcept = 0;

  /// One step. @param setpoint  joints from which this cycle goes on  @param velocity  of the command before
  /// @return why the arms have to hold instead; `result` says so, too
  virtual msg::HoldReason step(std::int64_t now,
                               const safety::RobotVector& setpoint,
                               const safety::RobotVector& velocity,
                               const planning::Reference& tasks,
                               planning::ReferenceTracker& tracker,
                               planning::TrackResult& result) noexcept = 0;

  /// At the end of every cycle: what the next one will need. @param velocity  that has been sent
  virtual void ask(std::int64_t now,
                   const safety::RobotVector& setpoint,
                   const safety::RobotVector& velocity,
                   const planning::ReferenceTracker& tracker) noexcept = 0;
};

}  // namespace tandem::operation
