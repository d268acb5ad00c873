// SPDX-License-Identifier: Apache-2.0
#include "services/cli/plan_setup.h"

#include <unistd.h>

#include <cstdio>

#include "services/cli/arm_options.h"

namespace tandem::cli {

PlanSetup::PlanSetup(const PlanOptions& options)
    : options_(options),
      robot_(config::loadRobot(config::findFile(options.robot, "robot"))),
      model_(robot_, options.model),
      arms_{model_.models(), model_.limits()},
      start_(startOf(options.from, options.joints)) {}

safety::RobotVector PlanSetup::startOf(const std::string& from, const std::string& joints) const {
  if (!joints.empty())
    return numbersOf("--joints", joints, model_.jointCount());
  std::vector<Eigen::VectorXd> home;
  for (const config::Arm& arm : robot_.arms)
    home.push_back(arm.home);
  if (from == "home")
    return model_.stack(home);
  const std::size_t colon = from.rfind(':');
  if (colon == std::string::npos)
    throw Failure(kUsage, "--from: found '" + from + "', expected home or EXPERIMENT:CONFIGURATION, e.g. table3:1");
  const config::Experiment experiment = config::loadExperiment(config::findFile(from.substr(0, colon), "experiment"));
  std::string known;
  for (const config::Configuration& configuration : experiment.configurations) {
    known += (known.empty() ? "" : ", ") + configuration.name;
    if (configuration.name != from.substr(colon + 1))
      continue;
    if (configuration.joints.size() != robot_.arms.size())
      throw Failure(kUsage, "--from: " + from + " is for another number of arms than --robot " + options_.robot);
    for (std::size_t k = 0; k < configuration.joints.size(); ++k) {
      if (configuration.joints[k].size() != robot_.arms[k].home.size())
        throw Failure(kUsage, "--from: " + from + " is for other joints than --robot " + options_.robot);
    }
    return model_.stack(configuration.joints);
  }
  throw Failure(kUsage, "--from: found '" + from.substr(colon + 1) + "', expected a configuration of " +
                            experiment.file.string() + ": " + known);
}

planning::IkOptions PlanSetup::ik() const {
  planning::IkOptions ik;
  // A rigid arm never snaps.
  if (options_.model != "rigid")
    ik.demands.stability = options_.stability;
  if (!options_.no_clearance && arms_.count() > 1)
    ik.demands.clearance = 1e-3 * options_.clearance_mm;
  if (options_.port_radius_mm > 0.0) {
    ik.demands.port.emplace();
    ik.demands.port->radius = 1e-3 * options_.port_radius_mm;
    ik.demands.port->depth = 1e-3 * options_.port_depth_mm;
  }
  ik.starts = options_.starts;
  ik.seed = options_.seed;
  ik.cancelled = [this] { return stop_.requested(); };
  return ik;
}

planning::FeasibilityOptions PlanSetup::feasibility(const std::string& label) const {
  planning::FeasibilityOptions options;
  options.ik = ik();
  options.accept = 1e-3 * options_.within_mm;
  if (!label.empty()) {
    auto progress = std::make_shared<PlanProgress>(label);
    options.progress = [progress](int done, int all) { progress->show(done, all); };
  }
  return options;
}

planning::RehearsalOptions PlanSetup::rehearsal(const std::string& label) const {
  planning::RehearsalOptions options;
  options.method = control::methodFromName(options_.method).value();
  options.parameters = robot_.parameters;
  for (const config::Arm& arm : robot_.arms)
    options.arms.push_back(arm.name);
  options.cancelled = [this] { return stop_.requested(); };
  auto progress = std::make_shared<PlanProgress>(label);
  options.progress = [progress](int done, int all) { progress->show(done, all); };
  return options;
}

planning::TrajectorySpec PlanSetup::trajectory() const {
  const auto file = config::findFile(options_.file, "trajectory");
  planning::TrajectorySpec spec = config::loadTrajectory(file);
  if (std::max(spec.arm, spec.other_arm) >= arms_.count()) {
    throw Failure(kUsage, file.string() + ": found arm " + std::to_string(std::max(spec.arm, spec.other_arm)) +
                              ", expected one of the " + std::to_string(arms_.count()) + " arms of " + robot_.name);
  }
  return spec;
}

void PlanProgress::show(int done, int all) {
  const int tenth = 10 * done / std::max(1, all);
  if (isatty(STDERR_FILENO) != 0)
    std::fprintf(stderr, "\r%s %d/%d%s", label_.c_str(), done, all, done == all ? "\n" : "");
  else if (tenth > tenth_ || done == all)
    std::fprintf(stderr, "%s %d/%d\n", label_.c_str(), done, all);
  tenth_ = done == all ? 0 : tenth;
}

nlohmann::ordered_json listOf(const Eigen::Ref<const Eigen::VectorXd>& numbers) {
  return std::vector<double>(numbers.begin(), numbers.end());
}

}  // namespace tandem::cli
