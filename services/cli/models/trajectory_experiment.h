// SPDX-License-Identifier: Apache-2.0
/** @file Runs of an experiment over DDS, in lock-step or in real time. */
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "experiments/closed_loop.h"
#include "services/cli/models/experiment_runner.h"

namespace tandem::cli {

/** Runs one plan after another, with a row per iteration.
 *
 * In lock-step the joints of the simulated robot are reset to each start. In real time, with simulated joints or with
 * hardware, they move there along a straight line in joint space, all arms at the same time. */
class TrajectoryExperiment {
 public:
  /// @param runner, model  outlive this
  TrajectoryExperiment(ExperimentRunner& runner, const config::Robot& robot, const robots::RobotModel& model);

  /// @throw Failure where a service refuses or publishes nothing, or a sample is missing.
  experiments::RunRecord run(const experiments::RunPlan& plan, const std::function<void(int, int)>& progress);

 private:
  void prepare(const experiments::RunPlan& plan);
  /// Lock-step. @return number of joint resets before it.
  std::uint32_t placeAtStart(const experiments::RunPlan& plan);
  void moveToStart(const experiments::RunPlan& plan);  ///< real time
  bool takeLockStep(RunMessages& messages, experiments::RunRecord& record, std::uint32_t id, bool& ended);
  bool takeRealTime(RunMessages& messages, experiments::RunRecord& record, std::uint32_t id, bool& ended);
  bool addRow(const RunMessages& messages, experiments::RunRecord& record, const dds::PlanningReference& reference);
  void addModelTips(experiments::StepData& data);
  bool closeIteration(RunMessages& messages, experiments::RunRecord& record, std::uint64_t judged_by);
  void follow(const experiments::RunPlan& plan,
              const std::function<void(int, int)>& progress,
              experiments::RunRecord& record);
  void refuseFault(const client::Snapshot& snapshot, const std::string& when) const;
  safety::RobotVector stacked(const dds::JointArray& joints) const;
  safety::RobotVector positions(const dds::ActuationState& state) const { return stacked(state.position); }

  ExperimentRunner& runner_;
  const robots::RobotModel& model_;
  std::vector<std::string> arm_names_;
  std::vector<kinematics::Branch> branches_;    ///< real time: of the model's tips
  std::optional<dds::PlanningReference> open_;  ///< real time: the first reference of an iteration not yet judged
  std::uint64_t gate_actions_before_ = 0;
};

}  // namespace tandem::cli
