// SPDX-License-Identifier: Apache-2.0
/** @file Planning state machine: requests and states in, references out; no DDS, no threads. */
#pragma once

#include <memory>
#include <optional>

#include "robots/robot_model.h"
#include "robots/run.h"
#include "services/dds/messages.h"
#include "services/planning/plan.h"
#include "services/runtime/process.h"

namespace tandem::planning_service {

/** Runs trajectories: requests in, references out. One thread.
 *
 * Real time: every control/status that used the last reference asks for the next one, so that one reference is one
 * control cycle; the state that it judges is the latest. Lock-step: every state of a new instant asks for the next one.
 * Where the tips are is what control takes them to be: its model's, or measured ones (`feedback`).
 * While nothing runs, references without tasks echo what has been received from state and control, so that a client
 * knows when a trajectory may start. */
class PlanningCore {
 public:
  explicit PlanningCore(const runtime::Setup& setup);

  void onState(const dds::ActuationState& state);
  void onStatus(const dds::ControlStatus& status);
  void onTips(const dds::TipPoses& tips);
  /// The last trajectory that was found feasible: it may be run with the joints that were found.
  void onPlan(Plan plan) { plan_ = std::move(plan); }
  /// A request of a client; `path` is filled when a trajectory was started.
  dds::Reply onRequest(const dds::PlanningRequest& request, std::optional<dds::Path>& path);

  /// The reference to publish now, if there is one.
  std::optional<dds::PlanningReference> take();

  /// Keeps the last reference alive while nothing else happens (paused, or control pauses): call about every 50 ms.
  void refresh();

  /// Why the last run ended before its time; empty where it did not.
  const std::string& ended() const { return ended_; }

 private:
  dds::Reply start(const dds::PlanningRequest& request, std::optional<dds::Path>& path);
  void followState();
  dds::Path pathOf(const std::vector<Eigen::Isometry3d>& points) const;
  std::string unplanned(const dds::PlanningRequest& request) const;
  robots::Measured measured() const;
  bool complete() const;
  void advanceInStep();
  void advance();
  void publish();
  void end(const std::string& why);
  bool active() const;

  const runtime::Setup& setup_;
  bool lock_step_;
  robots::RobotModel robot_;
  bool sensor_;  ///< where the tips are is measured
  planning::MeasuredTips sensor_tips_;
  dds::TipPoses tips_message_;
  bool waiting_ = false;  ///< lock-step: the present state asks for a reference
  std::unique_ptr<robots::Run> run_;
  std::string ended_;
  planning::Reference reference_;
  std::optional<Plan> plan_;  ///< of the last feasible check
  dds::ActuationState state_;
  dds::ControlStatus status_;
  std::uint32_t trajectory_id_;  ///< starts anywhere: numbers of a former process are not given again
  std::uint64_t sequence_ = 0;
  std::uint64_t asked_since_ = 0;       ///< sequence of the first reference that asks for what the present one asks for
  std::uint64_t commander_ = 0;         ///< client that started the running trajectory
  std::uint64_t session_at_start_ = 0;  ///< hal or sim session of the running trajectory
  std::optional<dds::PlanningReference> outgoing_;
};

}  // namespace tandem::planning_service
