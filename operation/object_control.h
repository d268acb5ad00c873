// SPDX-License-Identifier: Apache-2.0
/** @file Interface of closed-loop control of a common object. */
#pragma once

#include "idl/messages.h"
#include "planning/reference_tracker.h"

namespace tandem::operation {

/** Called from the periodic thread; an implementation may have its own thread. */
class ObjectControl {
 public:
  virtual ~ObjectControl() = default;

  /// The joints were reset without a motion.
  virtual void restart() noexcept = 0;

  /// One step. @param setpoint  start joints of this cycle @param velocity  of the previous command
  /// @return why the arms must hold; `result` has it, too
  virtual msg::HoldReason step(std::int64_t now,
                               const safety::RobotVector& setpoint,
                               const safety::RobotVector& velocity,
                               const planning::Reference& tasks,
                               planning::ReferenceTracker& tracker,
                               planning::TrackResult& result) noexcept = 0;

  /// Requests the data for the next cycle, at the end of every cycle. @param velocity  that has been sent
  virtual void requestEquilibrium(std::int64_t now,
                                  const safety::RobotVector& setpoint,
                                  const safety::RobotVector& velocity,
                                  const planning::ReferenceTracker& tracker) noexcept = 0;
};

}  // namespace tandem::operation
