// SPDX-License-Identifier: Apache-2.0
#include "experiments/closed_loop.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "planning/follower.h"
#include "sim/simulated_drives.h"

namespace tandem::experiments {
namespace {

/** The simulated robot of one run, enabled. */
class Plant {
 public:
  Plant(const config::Robot& robot, const RobotModel& model, const std::vector<Eigen::VectorXd>& start, double period)
      : model_(model), period_(period), drives_(make(robot, start, period)) {
    sim::Command enable = next();
    enable.request.fill(safety::DriveRequest::kEnable);
    send(enable);
    for (int k = 0; k < model_.armCount(); ++k) {
      if (drives_.state(k) != safety::OperatingState::kEnabled)
        throw std::runtime_error("an arm cannot be enabled");
    }
  }

  safety::RobotVector position() const {
    safety::RobotVector q(model_.jointCount());
    for (int k = 0; k < model_.armCount(); ++k)
      q.segment(model_.offset(k), model_.size(k)) = drives_.position(k);
    return q;
  }

  /// Interventions of the limit guards and refusals so far.
  std::uint64_t gateActions() const {
    std::uint64_t sum = 0;
    for (int g = 0; g < safety::kGuardCount; ++g)
      sum += drives_.guards()[static_cast<safety::Guard>(g)].count;
    return sum;
  }

  void move(const safety::RobotVector& velocity) {
    sim::Command command = next();
    for (int k = 0; k < model_.armCount(); ++k) {
      command.moving[static_cast<std::size_t>(k)] = true;
      for (int j = 0; j < model_.size(k); ++j) {
        const auto i = static_cast<std::size_t>(k * safety::kMaxJointsPerArm + j);
        command.velocity[i] = velocity[model_.offset(k) + j];
        command.position[i] = drives_.setpoint(k)[j] + period_ * command.velocity[i];
      }
    }
    send(command);
    time_ += static_cast<std::int64_t>(std::llround(1e9 * period_));
    drives_.advance(time_);
  }

 private:
  static sim::SimulatedDrives make(const config::Robot& robot,
                                   const std::vector<Eigen::VectorXd>& start,
                                   double period) {
    std::vector<safety::ArmLimits> limits;
    for (const config::Arm& arm : robot.arms)
      limits.push_back(arm.limits);
    sim::SimulatedDrivesOptions options;
    options.control_period = period;
    options.lock_step = true;
    return {limits, {start.begin(), start.end()}, options};
  }

  sim::Command next() {
    sim::Command command;
    command.head = {1, ++sequence_, 0.0, model_.armCount()};
    return command;
  }

  void send(const sim::Command& command) {
    if (!drives_.command(command, time_))
      throw std::runtime_error("the gate refused a command");
  }

  const RobotModel& model_;
  double period_;
  sim::SimulatedDrives drives_;
  std::uint64_t sequence_ = 0;
  std::int64_t time_ = 0;
};

}  // namespace

std::vector<RunPlan> plan(const config::Experiment& experiment) {
  std::vector<RunPlan> runs;
  std::vector<std::string> names;
  for (const config::ExperimentTrajectory& trajectory : experiment.trajectories) {
    if (std::find(names.begin(), names.end(), trajectory.spec.name) == names.end())
      names.push_back(trajectory.spec.name);
  }
  for (const std::string& name : names) {
    for (const control::Method method : experiment.methods) {
      for (const config::ExperimentTrajectory& trajectory : experiment.trajectories) {
        if (trajectory.spec.name != name)
          continue;
        for (const std::string& wanted : trajectory.configurations) {
          const auto found = std::find_if(experiment.configurations.begin(), experiment.configurations.end(),
                                          [&](const config::Configuration& c) { return c.name == wanted; });
          if (found == experiment.configurations.end())
            throw std::invalid_argument("unknown configuration " + wanted);
          runs.push_back({{name, wanted, method}, trajectory.spec, found->joints});
        }
      }
    }
  }
  return runs;
}

RunRecord runOffline(const config::Robot& robot,
                     const RobotModel& model,
                     const RunPlan& plan,
                     planning::Gains gains,
                     double control_period,
                     const std::function<void(int, int)>& progress) {
  Plant plant(robot, model, plan.start, control_period);
  control::MethodParameters parameters = robot.parameters;
  parameters.period = control_period;
  planning::ReferenceTracker tracker(model.models(), model.limits(), plan.key.method, parameters, gains);
  planning::Follower follower(control_period);
  RunRecord record(plan.key, model, plan.trajectory.point_count, plan.trajectory.tolerance);
  const auto measure = [&](const safety::RobotVector& q) {
    const Eigen::Vector3d tip = model.tip(plan.trajectory.arm, q);
    return std::pair<Eigen::Vector3d, Eigen::Vector3d>{tip, tip - model.tip(plan.trajectory.other_arm, q)};
  };

  auto [tip, relative] = measure(plant.position());
  follower.start(plan.trajectory, tip, relative);
  planning::TrackResult track;
  StepFacts facts;
  while (follower.update(tip, relative, facts.reference)) {
    const std::uint64_t actions = plant.gateActions();
    const safety::RobotVector q = plant.position();  // ideal joints: setpoint and measured are one
    tracker.step(q, q, facts.reference, track);
    if (track.status == planning::TrackStatus::kModel)
      throw std::runtime_error(std::string(describe(track.model)));
    plant.move(track.solution.velocity);
    facts.point = follower.progress().point;
    facts.iteration = follower.progress().iteration;
    facts.position = plant.position();
    facts.scale = {track.solution.scale[0], track.solution.scale[1]};
    facts.solver_iterations = static_cast<std::uint32_t>(track.solution.iterations);
    facts.active_limits = static_cast<std::uint32_t>(track.solution.active_count);
    facts.gate_actions = plant.gateActions() - actions;
    record.add(facts);
    std::tie(tip, relative) = measure(facts.position);
    if (progress)
      progress(facts.point, plan.trajectory.point_count);
  }
  return record;
}

}  // namespace tandem::experiments
