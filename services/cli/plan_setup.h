// SPDX-License-Identifier: Apache-2.0
/** @file What the subcommands of `tandem plan` share: robot, start, demands, and how they tell how far they are. */
#pragma once

#include <chrono>
#include <nlohmann/json.hpp>

#include "config/config.h"
#include "experiments/run_record.h"
#include "planning/feasibility.h"
#include "planning/rehearsal.h"
#include "services/cli/arguments.h"
#include "services/common/stop_signal.h"

namespace tandem::cli {

struct PlanOptions {
  std::string file, robot = "ark2024", model = "rigid", from = "home", joints, output;
  double stability = 0.05, clearance_mm = 0.0, port_radius_mm = 0.0, port_depth_mm = 0.0, within_mm = 0.01;
  double smoothing = 3.0;
  double translation_acceleration = 0.0, rotation_velocity = 0.0,
         rotation_acceleration = 0.0;  ///< mm/s^2, rad/s(^2); 0: file's
  std::string position, direction, arm = "a", csv;
  std::vector<std::string> tips;
  std::string method = std::string(control::name(config::Deployment{}.method));
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
  const planning::Arms& arms() const { return arms_; }
  const safety::RobotVector& start() const { return start_; }
  planning::IkOptions ik() const;
  planning::FeasibilityOptions feasibility(const std::string& label) const;
  /// With the method of the options and the robot file's parameters.
  planning::RehearsalOptions rehearsal(const std::string& label) const;
  /// The trajectory of options.file, a path or the name of a preset.
  planning::TrajectorySpec trajectory() const;
  bool cancelled() const { return stop_.requested(); }

 private:
  safety::RobotVector startOf(const std::string& from, const std::string& joints) const;

  const PlanOptions& options_;
  service::StopSignal stop_;
  config::Robot robot_;
  experiments::RobotModel model_;
  planning::Arms arms_;
  safety::RobotVector start_;
};

/// A line on standard error that is rewritten on a terminal, and printed once per tenth elsewhere.
class PlanProgress {
 public:
  explicit PlanProgress(std::string label) : label_(std::move(label)) {}
  void show(int done, int all);

 private:
  std::string label_;
  int tenth_ = 0;
};

/// A joint vector as a JSON list, and three numbers as one.
nlohmann::ordered_json listOf(const Eigen::Ref<const Eigen::VectorXd>& numbers);

}  // namespace tandem::cli
