// SPDX-License-Identifier: Apache-2.0
/** @file Task loop: from tasks and tip poses to joint velocities, with the limits that restrict them. */
#pragma once

#include <memory>

#include "control/conflict.h"
#include "operation/drive_exchange.h"
#include "operation/object_control.h"
#include "operation/tip_feedback.h"
#include "planning/reference_tracker.h"
#include "planning/teleoperation/pipeline.h"
#include "safety/faults.h"

namespace tandem::operation {

/** Closes the loop on the model's tips, on measured tips, or on the common object. Nothing allocates in a
 * cycle, except ObjectControl in lock-step. */
class TaskLoop {
 public:
  /// Keeps `drives` and `object_control` by reference. @param object_control  for arms that move a common object; null
  /// for independent tips
  TaskLoop(const ControlSetup& setup,
           const DriveExchange& drives,
           std::unique_ptr<planning::ReferenceTracker> tracker,
           ObjectControl* object_control);

  void onTips(const msg::TipPoses& tips) noexcept { tips_.take(tips); }
  /// The joints were reset: models of elastic arms, which depend on past motion, start cold.
  void restart() noexcept;
  /// Changes the method. @return the tracker that was in use
  planning::ReferenceTracker* exchange(planning::ReferenceTracker* tracker) noexcept;

  /// Begins a cycle without tasks.
  void begin() noexcept;
  /// Tip poses, as used in the errors of tasks. @return false if they are unknown.
  bool findTips(planning::teleoperation::TipPlaces& tips) noexcept;
  /// Computes velocities for the tasks; arms may move unless hold() has a reason. @return a fault; empty: none
  safety::FaultRecord follow(const planning::Reference& tasks, std::int64_t now) noexcept;
  /// A cycle without tasks.
  void observe() noexcept { tracker_->observe(drives_.measured(), drives_.setpoints()); }
  /// At the end of a cycle, after the command was sent.
  void prepareNext(std::int64_t now) noexcept;

  msg::HoldReason hold() const noexcept { return hold_; }
  const planning::TrackResult& result() const noexcept { return result_; }
  const planning::Gains& gains() const noexcept { return tracker_->gains(); }
  /// Lock-step: whether all data of the present state have arrived.
  bool complete() const noexcept { return !sensor_ || tips_.knows(drives_.state()); }

  void fill(msg::ActuationLimits& limits) const noexcept;
  void fill(msg::ControlStatus& status) noexcept;

 private:
  void closeLoop(std::int64_t now) noexcept;
  safety::FaultRecord judge() noexcept;
  const control::Conflict* conflict(msg::ControlStatus& status) noexcept;

  ControlSetup setup_;
  const DriveExchange& drives_;
  std::unique_ptr<planning::ReferenceTracker> tracker_;
  ObjectControl* object_control_;
  bool sensor_;  ///< task errors use measured tips
  TipFeedback tips_;
  planning::Reference tasks_;
  planning::TrackResult result_;
  control::Conflict standing_;  ///< active limits that stop the joints
  msg::HoldReason hold_ = msg::HoldReason::kNone;
  bool solved_ = false;  ///< result_ is of this cycle
  double solve_time_ = 0.0;
  double unsolved_ = 0.0;  ///< time of consecutive resolver failures, s
};

}  // namespace tandem::operation
