// SPDX-License-Identifier: Apache-2.0
/** @file Options shared by the subcommands of `tandem plan`: robot, start, requirements, local or remote computation;
 * progress line. */
#pragma once

#include <memory>
#include <optional>

#include "services/cli/plan/live_planner.h"
#include "services/cli/subcommand.h"
#include "services/computation/computation.h"
#include "services/runtime/stop_signal.h"

namespace tandem::cli {

struct PlanOptions {
  std::string file, robot = "ark2024", model = "rigid", from, joints, output;
  std::string deployment;  ///< of the running system that computes; empty: this process computes
  double stability = 0.05, clearance_mm = 0.0, port_radius_mm = 0.0, port_depth_mm = 0.0, within_mm = 0.01;
  double smoothing = 3.0;
  double translation_acceleration = 0.0, rotation_velocity = 0.0,
         rotation_acceleration = 0.0;  ///< mm/s^2, rad/s, rad/s^2; 0: those of the file
  std::string csv;
  std::string method;  ///< of the rehearsal; empty: the default of deployments, or that of the running system
  std::vector<std::string> settings;  ///< of the rehearsal: NAME=VALUE
  std::vector<std::string> tips;
  bool no_clearance = false, json = false, no_rehearsal = false;
  int starts = 12, tries = 20;
  std::uint64_t seed = 1;
};

/** Robot, model and requirements of a planning computation. Ctrl-C cancels it. */
class PlanSetup {
 public:
  /// @throw Failure, also for a trajectory of other arms, or config::Error: each names the option or the place in the
  /// file.
  explicit PlanSetup(const PlanOptions& options);
  PlanSetup(const PlanSetup&) = delete;
  PlanSetup& operator=(const PlanSetup&) = delete;

  const config::Robot& robot() const { return robot_; }
  const robots::RobotModel& model() const { return model_; }
  /// Request with the requirements of the options, and the trajectory in options.file if given.
  dds::ComputationRequest request(dds::ComputationKind kind) const;
  /// The trajectory in options.file, with its arms.
  const planning::TrajectorySpec& trajectory() const { return trajectory_; }
  /// Method of the rehearsal.
  std::string method() const;
  /// Computes here, or in the running system. @throw Failure if the computation is cancelled, refused or fails.
  dds::ComputationResult compute(const dds::ComputationRequest& request);

 private:
  void warnOfOverlap(const dds::ComputationRequest& request) const;
  std::vector<double> startOf(const std::string& from, const std::string& joints) const;

  const PlanOptions& options_;
  runtime::StopSignal stop_;
  std::optional<config::Deployment> deployment_;  ///< of the running system
  config::Robot robot_;
  std::string model_name_;
  robots::RobotModel model_;
  planning::TrajectorySpec trajectory_;
};

/// Progress line on standard error: rewritten on a terminal; elsewhere the first line and one per tenth.
class PlanProgress {
 public:
  void show(const std::string& at, int done, int all);

 private:
  std::string at_;
  int tenth_ = -1;
};

/// Computation by the running system, with progress on standard error.
/// @throw as PlanSetup::compute()
dds::ComputationResult computeLive(const config::Deployment& deployment,
                                   const dds::ComputationRequest& request,
                                   std::function<bool()> interrupted);

}  // namespace tandem::cli
