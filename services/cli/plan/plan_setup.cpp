// SPDX-License-Identifier: Apache-2.0
#include "services/cli/plan/plan_setup.h"

#include <unistd.h>

#include <cstdio>

#include "config/arm_names.h"
#include "config/robot_files.h"
#include "robots/capability.h"
#include "robots/overlap.h"
#include "services/cli/models/arm_options.h"
#include "services/runtime/process.h"

namespace tandem::cli {
namespace {

std::optional<config::Deployment> deploymentOf(const PlanOptions& options) {
  if (options.deployment.empty())
    return std::nullopt;
  return runtime::loadDeployment(options.deployment);
}

/// @throw Failure(kUsage) for a robot that planning has no computations for.
config::Robot robotOf(const std::filesystem::path& file) {
  config::Robot robot = config::loadAnyRobot(file);
  if (const std::string why = refusal(robot, robots::Capability::kComputation); !why.empty())
    throw Failure(kUsage, why);
  return robot;
}

/// The result. @throw Failure if it was cancelled or failed.
dds::ComputationResult answered(dds::ComputationResult result) {
  const auto outcome = static_cast<dds::Outcome>(result.outcome);
  if (outcome == dds::Outcome::kCancelled || outcome == dds::Outcome::kFailed)
    throw Failure(kFailure, result.reason);
  return result;
}

}  // namespace

PlanSetup::PlanSetup(const PlanOptions& options)
    : options_(options),
      deployment_(deploymentOf(options)),
      robot_(robotOf(deployment_ ? deployment_->robot : config::findFile(options.robot, config::robotKinds()))),
      model_name_(deployment_ ? deployment_->model : options.model),
      model_(robot_, model_name_) {
  if (options.file.empty())
    return;
  const auto file = config::findFile(options.file, "trajectory");
  trajectory_ = config::loadTrajectory(file);
  if (const std::string wrong = config::findArms(trajectory_, robot_); !wrong.empty())
    throw Failure(kUsage, file.string() + ": " + wrong + " (robot " + robot_.name + ")");
}

/// Empty: the robot's present joint positions.
std::vector<double> PlanSetup::startOf(const std::string& from, const std::string& joints) const {
  const auto list = [](const Eigen::VectorXd& q) { return std::vector<double>(q.begin(), q.end()); };
  if (!joints.empty())
    return list(numbersOf("--joints", joints, model_.jointCount()));
  if (deployment_ && from.empty())
    return {};
  std::vector<Eigen::VectorXd> home;
  for (const config::Arm& arm : robot_.arms)
    home.push_back(arm.home);
  if (from.empty() || from == "home")
    return list(model_.stack(home));
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
      throw Failure(kUsage, "--from: " + from + " is for another number of arms than robot " + robot_.name);
    for (std::size_t k = 0; k < configuration.joints.size(); ++k) {
      if (configuration.joints[k].size() != robot_.arms[k].home.size())
        throw Failure(kUsage, "--from: " + from + " is for other joints than robot " + robot_.name);
    }
    return list(model_.stack(configuration.joints));
  }
  throw Failure(kUsage, "--from: found '" + from.substr(colon + 1) + "', expected a configuration of " +
                            experiment.file.string() + ": " + known);
}

std::string PlanSetup::method() const {
  if (!options_.method.empty())
    return options_.method;
  return std::string(control::name(deployment_ ? deployment_->method : config::Deployment{}.method));
}

dds::ComputationRequest PlanSetup::request(dds::ComputationKind kind) const {
  dds::ComputationRequest request;
  request.kind = static_cast<std::uint8_t>(kind);
  if (!options_.file.empty())
    request.trajectory = config::formatTrajectory(trajectory_);
  request.joints = startOf(options_.from, options_.joints);
  request.stability = options_.stability;
  request.arms_may_touch = options_.no_clearance ? 1 : 0;
  request.clearance = 1e-3 * options_.clearance_mm;
  request.port_radius = 1e-3 * options_.port_radius_mm;
  request.port_depth = 1e-3 * options_.port_depth_mm;
  request.accept = 1e-3 * options_.within_mm;
  request.starts = static_cast<std::uint32_t>(options_.starts);
  request.seed = options_.seed;
  if (kind == dds::ComputationKind::kCheck && !options_.no_rehearsal)
    request.rehearse = method();
  for (const std::string& setting : options_.settings) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos)
      throw Failure(kUsage, "--set: found '" + setting + "', expected NAME=VALUE, e.g. tip_gain=5");
    request.parameters.push_back({setting.substr(0, equals), setting.substr(equals + 1)});
  }
  request.smoothing = options_.smoothing;
  request.tries = static_cast<std::uint32_t>(options_.tries);
  request.translation_acceleration = 1e-3 * options_.translation_acceleration;
  request.rotation_velocity = options_.rotation_velocity;
  request.rotation_acceleration = options_.rotation_acceleration;
  return request;
}

/// Overlaps of the arms at the start of a computation.
void PlanSetup::warnOfOverlap(const dds::ComputationRequest& request) const {
  if (request.arms_may_touch != 0 || std::ssize(request.joints) != model_.jointCount())
    return;
  std::vector<Eigen::VectorXd> joints;
  for (int k = 0; k < model_.armCount(); ++k)
    joints.emplace_back(Eigen::VectorXd::Map(request.joints.data() + model_.offset(k), model_.size(k)));
  for (const std::string& overlap : robots::describeOverlaps(robot_, model_, joints))
    std::fprintf(stderr, "warning: at the start %s\n", overlap.c_str());
}

dds::ComputationResult PlanSetup::compute(const dds::ComputationRequest& request) {
  warnOfOverlap(request);
  if (deployment_)
    return computeLive(*deployment_, request, [this] { return stop_.requested(); });
  PlanProgress progress;
  computation::ComputationHooks hooks;
  hooks.cancelled = [this] { return stop_.requested(); };
  hooks.progress = [&](double, const std::string& at, int done, int all) { progress.show(at, done, all); };
  try {
    const computation::Computation computation(request, {robot_, model_, model_name_ == "rigid"}, std::nullopt);
    return answered(computation.run(hooks));
  } catch (const computation::Refusal& refusal) {
    throw Failure(kUsage, refusal.what());
  }
}

dds::ComputationResult computeLive(const config::Deployment& deployment,
                                   const dds::ComputationRequest& request,
                                   std::function<bool()> interrupted) {
  LivePlanner planner(deployment, std::move(interrupted));
  PlanProgress progress;
  return answered(planner.compute(request, [&](const dds::ComputationProgress& step) {
    progress.show(step.at, static_cast<int>(step.done), static_cast<int>(step.all));
  }));
}

void PlanProgress::show(const std::string& at, int done, int all) {
  if (all == 0)
    return;
  if (at != at_)
    tenth_ = -1;
  at_ = at;
  const int tenth = 10 * done / all;
  if (isatty(STDERR_FILENO) != 0)
    std::fprintf(stderr, "\r%s %d/%d%s", at.c_str(), done, all, done == all ? "\n" : "");
  else if (tenth > tenth_ || done == all)
    std::fprintf(stderr, "%s %d/%d\n", at.c_str(), done, all);
  tenth_ = done == all ? 10 : tenth;
}

}  // namespace tandem::cli
