// SPDX-License-Identifier: Apache-2.0
/** @file Experiment runner: the runs of an experiment over DDS, in lock-step or in real time. */
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>

#include "experiments/closed_loop.h"
#include "services/client/client.h"

namespace tandem::cli {

/** Drives the running processes through one plan after another and collects a row per iteration from the topics.
 *
 * In lock-step the simulated robot is put to each start. In real time, with simulated joints or with hardware, it is
 * moved there along a straight line in joint space, arm by arm at the same time. */
class ExperimentRunner {
 public:
  /// Connects and takes the control lease. @param interrupted  ends waiting: a process died or the user asked.
  ExperimentRunner(const config::Deployment& deployment,
                   const config::Robot& robot,
                   const robots::RobotModel& model,
                   std::function<bool()> interrupted);
  ~ExperimentRunner();

  /// @throw Failure where a service refuses, falls silent, or a sample is missing.
  experiments::RunRecord run(const experiments::RunPlan& plan, const std::function<void(int, int)>& progress);

 private:
  void prepare(const experiments::RunPlan& plan);
  /// Lock-step. @return number of joint resets before it.
  std::uint32_t placeAtStart(const experiments::RunPlan& plan);
  void moveToStart(const experiments::RunPlan& plan);  ///< real time
  void forget();                                       ///< what was collected before the run
  bool collectLockStep(experiments::RunRecord& record, std::uint32_t id, bool& ended);
  bool collectRealTime(experiments::RunRecord& record, std::uint32_t id, bool& ended);
  bool addRow(experiments::RunRecord& record, const dds::PlanningReference& reference);
  void addModelTips(experiments::StepData& data);
  bool closeIteration(experiments::RunRecord& record, std::uint64_t judged_by);
  void follow(const experiments::RunPlan& plan,
              const std::function<void(int, int)>& progress,
              experiments::RunRecord& record);
  void refuseFault(const client::Snapshot& snapshot, const std::string& when) const;
  safety::RobotVector stacked(const dds::JointArray& joints) const;
  safety::RobotVector positions(const dds::ActuationState& state) const { return stacked(state.position); }

  const robots::RobotModel& model_;
  mutable std::mutex mutex_;
  std::deque<dds::PlanningReference> references_;        ///< in order of arrival
  std::map<std::uint64_t, dds::ActuationState> states_;  ///< by sequence
  /// Statuses with a solution, by the state that they answer; in real time by the reference.
  std::map<std::uint64_t, dds::ControlStatus> statuses_;
  std::map<std::uint64_t, std::uint64_t>
      gate_actions_;                             ///< since start, by the sequence of the state that they go with
  std::vector<kinematics::Branch> branches_;     ///< real time: of the model's tips
  std::map<std::uint64_t, dds::TipPoses> tips_;  ///< lock-step: where the tips are, by the state that they go with
  std::optional<dds::PlanningReference> open_;   ///< real time: the first reference of an iteration not yet judged
  std::uint64_t gate_actions_before_ = 0;
  bool lock_step_;
  std::vector<std::string> arm_names_;
  std::unique_ptr<client::Client> client_;
};

}  // namespace tandem::cli
