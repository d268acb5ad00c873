// SPDX-License-Identifier: Apache-2.0
/** @file Planning state machine: computes references from requests and states; no DDS, no threads. */
#pragma once

#include <memory>
#include <optional>

#include "robots/robot_model.h"
#include "robots/run.h"
#include "services/dds/messages.h"
#include "services/planning/plan.h"
#include "services/planning/run_recorder.h"
#include "services/runtime/process.h"
#include "services/runtime/ros_time.h"

namespace tandem::planning_service {

/** Runs trajectories as sequences of references. For one thread.
 *
 * Real time: every control/status that answers the last reference triggers the next one, so that each control cycle
 * gets one reference, computed from the latest state. Lock-step: every state with a new stamp triggers the next one.
 * Tip positions have the same source as in control: model or measurement (`feedback`). Without a run, references
 * without tasks contain the sequences of the received state and status, from which a client detects that a trajectory
 * may start.
 */
class PlanningCore {
 public:
  explicit PlanningCore(const runtime::Setup& setup);

  void onState(const dds::ActuationState& state);
  void onStatus(const dds::ControlStatus& status);
  void onClearances(const dds::Clearances& clearances);
  void onTips(const dds::TipPoses& tips);
  /// Stores the last trajectory that was found feasible: it may run with its planned joints.
  void onPlan(Plan plan) { plan_ = std::move(plan); }
  /// A request of a client; `path` is filled when a trajectory was started.
  dds::Reply onRequest(const dds::PlanningRequest& request, std::optional<dds::Path>& path);

  /// Interventions of the gate since the drive side started, as last reported.
  void setGateInterventions(std::uint64_t count) { gate_interventions_ = count; }

  /// The reference to publish now, if there is one.
  std::optional<dds::PlanningReference> take();
  /// The summary to publish now: that of a run that has just ended.
  std::optional<dds::RunSummary> takeSummary();

  /// Repeats the last reference while no message triggers one (run or arms paused), so that it does not become stale:
  /// call about every 50 ms.
  void refresh();

  /// Name of the last trajectory or path; empty before the first.
  std::string trajectory() const { return commander_ == 0 ? "" : run_->name(); }
  /// Reason for the early end of the last run; empty otherwise.
  const std::string& ended() const { return ended_; }

 private:
  dds::Reply start(const dds::PlanningRequest& request, std::optional<dds::Path>& path);
  void followState();
  dds::Path pathOf(const std::vector<Eigen::Isometry3d>& points);
  std::string unplanned(const dds::PlanningRequest& request) const;
  robots::Measured measured() const;
  bool complete() const;
  void advanceInStep();
  void advance();
  void publish();
  void summarise();
  std::int64_t now() const;
  void end(const std::string& why);
  bool active() const;

  const runtime::Setup& setup_;
  bool lock_step_;
  runtime::RosTime ros_time_;
  robots::RobotModel robot_;
  bool sensor_;  ///< tips are measured by a sensor
  planning::MeasuredTips sensor_tips_;
  dds::TipPoses tips_message_;
  bool waiting_ = false;  ///< lock-step: the present state needs a reference
  std::unique_ptr<robots::Run> run_;
  std::string ended_;
  planning::Reference reference_;
  std::optional<Plan> plan_;  ///< of the last feasible check
  dds::ActuationState state_;
  dds::ControlStatus status_;
  std::uint32_t trajectory_id_;  ///< random start value, so that ids of a former process are not repeated
  std::uint64_t sequence_ = 0;
  std::uint64_t asked_since_ = 0;       ///< sequence of the first repetition of the present reference
  std::uint64_t commander_ = 0;         ///< client that started the running trajectory
  std::uint64_t session_at_start_ = 0;  ///< hal or sim session of the running trajectory
  std::uint64_t gate_interventions_ = 0;
  RunRecorder recorder_;
  std::optional<dds::PlanningReference> outgoing_;
  std::optional<dds::RunSummary> summary_;
};

}  // namespace tandem::planning_service
