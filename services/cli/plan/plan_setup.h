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
  std::string deployment;  ///< whose running system is asked; empty: computed here
  double stability = 0.05, clearance_mm = 0.0, port_radius_mm = 0.0, port_depth_mm = 0.0, within_mm = 0.01;
  double smoothing = 3.0;
  double translation_acceleration = 0.0, rotation_velocity = 0.0,
         rotation_acceleration = 0.0;  ///< mm/s^2, rad/s(^2); 0: file's
  std::string csv;
  std::string method;  ///< of the rehearsal; empty: the default of deployments, or that of the running one
  std::vector<std::string> tips;
  bool no_clearance = false, json = false, no_rehearsal = false;
  int starts = 12, tries = 20;
  std::uint64_t seed = 1;
};

/** Everything that a plan is made with. Ctrl-C cancels. */
class PlanSetup {
 public:
  /// @throw Failure or config::Error that names the option or the place in the file.
  explicit PlanSetup(const PlanOptions& options);
  PlanSetup(const PlanSetup&) = delete;
  PlanSetup& operator=(const PlanSetup&) = delete;

  const config::Robot& robot() const { return robot_; }
  const robots::RobotModel& model() const { return model_; }
  /// With the demands of the options, and the trajectory of options.file, if there is one.
  dds::ComputationRequest request(dds::ComputationKind kind) const;
  /// Of the rehearsal.
  std::string method() const;
  /// Here, or by the running system. @throw Failure where it is cancelled, refused or failed.
  dds::ComputationResult compute(const dds::ComputationRequest& request);

 private:
  std::vector<double> startOf(const std::string& from, const std::string& joints) const;
  std::string trajectory() const;

  const PlanOptions& options_;
  runtime::StopSignal stop_;
  std::optional<config::Deployment> deployment_;  ///< of the running system
  config::Robot robot_;
  std::string model_name_;
  robots::RobotModel model_;
};

/// A line on standard error that is rewritten on a terminal; elsewhere the first one, and one per tenth.
class PlanProgress {
 public:
  void show(const std::string& at, int done, int all);

 private:
  std::string at_;
  int tenth_ = -1;
};

/// What the running system says to a request, with progress on standard error.
/// @throw as PlanSetup::compute()
dds::ComputationResult computeLive(const config::Deployment& deployment,
                                   const dds::ComputationRequest& request,
                                   std::function<bool()> interrupted);

}  // namespace tandem::cli
