// SPDX-License-Identifier: Apache-2.0
/** @file Runs an experiment's plans over DDS on a system in lock-step. */
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>

#include "experiments/closed_loop.h"
#include "services/cli/client.h"

namespace tandem::cli {

/** Drives the running processes through one plan after another and collects a row per iteration from the topics. */
class ExperimentRunner {
 public:
  /// Connects and takes the control lease. @param interrupted  ends waiting: a process died or the user asked.
  ExperimentRunner(const config::Deployment& deployment,
                   const config::Robot& robot,
                   const experiments::RobotModel& model,
                   std::function<bool()> interrupted);
  ~ExperimentRunner();

  /// @throw Failure where a service refuses, falls silent, or a sample is missing.
  experiments::RunRecord run(const experiments::RunPlan& plan, const std::function<void(int, int)>& progress);

 private:
  void prepare(const experiments::RunPlan& plan);
  void forget();  ///< what was collected before the run
  bool addRow(experiments::RunRecord& record, const dds::PlanningReference& reference);
  safety::RobotVector positions(const dds::ActuationState& state) const;

  const experiments::RobotModel& model_;
  mutable std::mutex mutex_;
  std::deque<dds::PlanningReference> references_;         ///< in order of arrival
  std::map<std::uint64_t, dds::ActuationState> states_;   ///< by sequence
  std::map<std::uint64_t, dds::ControlStatus> statuses_;  ///< those with a solution, by the state that they answer
  std::map<std::uint64_t, std::uint64_t>
      gate_actions_;                             ///< since start, by the sequence of the state that they go with
  std::map<std::uint64_t, dds::TipPoses> tips_;  ///< where the tips really are, by the state that they go with
  std::unique_ptr<Client> client_;
};

}  // namespace tandem::cli
