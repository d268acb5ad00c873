// SPDX-License-Identifier: Apache-2.0
/** @file In-process simulated robot of one run. */
#pragma once

#include <optional>

#include "experiments/run_record.h"
#include "planning/reference_tracker.h"
#include "sim/plant_tips.h"
#include "sim/simulated_drives.h"
#include "sim/tip_tracker.h"

namespace tandem::experiments {

/** Options of a closed loop. */
struct LoopOptions {
  double control_period = 0.1;  ///< T, s
  planning::Gains gains;
  planning::Feedback feedback = planning::Feedback::kModel, orientation_feedback = planning::Feedback::kModel;
  sim::PlantOptions plant;
  safety::Budgets budgets;
};

/** Gate, simulated joints and tips of all arms in lock-step, enabled. Time is simulated. */
class SimulatedRobot {
 public:
  /// @param start  joints of each arm, inside its limits, m and rad. `model` and `options` are kept by reference.
  /// @throw std::invalid_argument where a start is outside, std::runtime_error where an arm cannot be enabled.
  SimulatedRobot(const config::Robot& robot,
                 const RobotModel& model,
                 const std::vector<Eigen::VectorXd>& start,
                 const LoopOptions& options);

  /// Readings of the encoders, arms stacked, m and rad.
  safety::RobotVector position() const;
  /// The last setpoints that passed the gate.
  safety::RobotVector setpoint() const;
  /// True poses of the tips.
  const sim::PlantTips& tips() const { return tips_; }
  /// Tips that the tracker has measured, if there is one.
  const planning::MeasuredTips& measuredTips() const { return measured_; }
  /// ns
  std::int64_t time() const { return time_; }
  /// Interventions of the limit guards and refusals so far.
  std::uint64_t gateActions() const;

  /// One control period at these joint velocities, m/s and rad/s, or at standstill.
  /// @throw std::runtime_error where the gate refuses the command or the plant's model cannot answer.
  void move(const safety::RobotVector& velocity, bool moving);

 private:
  template <class OfArm>
  safety::RobotVector stacked(OfArm of_arm) const;
  void updateTips();
  void listen();
  sim::Command next();
  void send(const sim::Command& command);

  const RobotModel& model_;
  std::vector<std::string> names_;  ///< of the arms
  double period_;
  sim::SimulatedDrives drives_;
  sim::PlantTips tips_;
  std::optional<sim::TipTracker> tracker_;
  planning::MeasuredTips measured_;
  std::uint64_t sequence_ = 0;
  std::int64_t time_ = 0;
};

}  // namespace tandem::experiments
