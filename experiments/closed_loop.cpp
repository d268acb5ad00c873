// SPDX-License-Identifier: Apache-2.0
#include "experiments/closed_loop.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "planning/follower.h"
#include "sim/plant_tips.h"
#include "sim/simulated_drives.h"
#include "sim/tip_tracker.h"

namespace tandem::experiments {
namespace {

/** The simulated robot of one run, enabled. */
class Plant {
 public:
  Plant(const config::Robot& robot,
        const RobotModel& model,
        const std::vector<Eigen::VectorXd>& start,
        const LoopOptions& options)
      : model_(model),
        period_(options.control_period),
        drives_(makeDrives(robot, start, options)),
        tips_(armsOf(robot), options.plant) {
    sim::Command enable = next();
    enable.request.fill(safety::DriveRequest::kEnable);
    send(enable);
    for (int k = 0; k < model_.armCount(); ++k) {
      if (drives_.state(k) != safety::OperatingState::kEnabled)
        throw std::runtime_error("an arm cannot be enabled");
    }
    updateTips();
    if (options.plant.tracker.present) {
      tracker_.emplace(model_.armCount(), options.plant.tracker, options.plant.seed);
      tracker_->restart(tips_, time_, drives_.answersCommand());
      listen();
    }
  }

  /// What the encoders read.
  safety::RobotVector position() const {
    return stacked([this](int k) { return drives_.position(k); });
  }
  safety::RobotVector setpoint() const {
    return stacked([this](int k) { return drives_.setpoint(k); });
  }
  const sim::PlantTips& tips() const { return tips_; }
  const planning::MeasuredTips& measuredTips() const { return measured_; }
  std::int64_t time() const { return time_; }

  /// Interventions of the limit guards and refusals so far.
  std::uint64_t gateActions() const {
    std::uint64_t sum = 0;
    for (int g = 0; g < safety::kGuardCount; ++g)
      sum += drives_.guards()[static_cast<safety::Guard>(g)].count;
    return sum;
  }

  void move(const safety::RobotVector& velocity, bool moving) {
    sim::Command command = next();
    for (int k = 0; k < model_.armCount(); ++k) {
      command.moving[static_cast<std::size_t>(k)] = moving;
      for (int j = 0; j < model_.size(k); ++j) {
        const auto i = static_cast<std::size_t>(k * safety::kMaxJointsPerArm + j);
        command.velocity[i] = moving ? velocity[model_.offset(k) + j] : 0.0;
        command.position[i] = drives_.setpoint(k)[j] + period_ * command.velocity[i];
      }
    }
    send(command);
    time_ += static_cast<std::int64_t>(std::llround(1e9 * period_));
    drives_.advance(time_);
    updateTips();
    if (tracker_) {
      tracker_->step(tips_, time_, drives_.answersCommand());
      listen();
    }
  }

 private:
  static std::vector<kinematics::ConcentricTubeArm> armsOf(const config::Robot& robot) {
    std::vector<kinematics::ConcentricTubeArm> arms;
    for (const config::Arm& arm : robot.arms)
      arms.push_back(arm.model);
    return arms;
  }

  static sim::SimulatedDrives makeDrives(const config::Robot& robot,
                                         const std::vector<Eigen::VectorXd>& start,
                                         const LoopOptions& loop) {
    std::vector<safety::ArmLimits> limits;
    for (const config::Arm& arm : robot.arms)
      limits.push_back(arm.limits);
    sim::SimulatedDrivesOptions options;
    options.control_period = loop.control_period;
    options.lock_step = true;
    options.mechanics = loop.plant.mechanics;
    options.encoders = loop.plant.encoders;
    options.seed = loop.plant.seed;
    return {limits, {start.begin(), start.end()}, options};
  }

  template <class OfArm>
  safety::RobotVector stacked(OfArm of_arm) const {
    safety::RobotVector q(model_.jointCount());
    for (int k = 0; k < model_.armCount(); ++k)
      q.segment(model_.offset(k), model_.size(k)) = of_arm(k);
    return q;
  }

  void updateTips() {
    for (int k = 0; k < model_.armCount(); ++k) {
      tips_.update(k, drives_.plant(k).tubes());
      if (!tips_.valid(k))
        throw std::runtime_error("the plant: " + std::string(kinematics::describe(tips_.status(k))));
    }
  }

  void listen() {
    const sim::TipMeasurement& latest = tracker_->latest();
    for (int k = 0; k < model_.armCount(); ++k) {
      const auto i = static_cast<std::size_t>(k);
      measured_.take(k, latest.valid[i], latest.position[i], latest.stamp, latest.mark);
    }
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
  sim::PlantTips tips_;
  std::optional<sim::TipTracker> tracker_;
  planning::MeasuredTips measured_;
  std::uint64_t sequence_ = 0;
  std::int64_t time_ = 0;
};

/** Control of one run: which tips it believes, and its step. */
class Controller {
 public:
  Controller(const config::Robot& robot, const RobotModel& model, control::Method method, const LoopOptions& options)
      : options_(options), tracker_(make(robot, model, method, options)) {}

  /// What planning judges the state with, as it does in its own process: tip, and tip less the other one's.
  std::pair<Eigen::Vector3d, Eigen::Vector3d> see(const Plant& plant, int arm, int other) {
    if (!tracker_.computeTips(plant.position(), track_))
      throw std::runtime_error(std::string(kinematics::describe(track_.model)));
    const auto tip = [&](int k) -> Eigen::Vector3d {
      const auto i = static_cast<std::size_t>(k);
      return sensor() ? plant.measuredTips().arm[i].position : track_.tip[i].pose.translation();
    };
    return {tip(arm), tip(arm) - tip(other)};
  }

  /// @return whether the arms shall move.
  bool step(const Plant& plant, const planning::Reference& reference) {
    const safety::RobotVector q = plant.position(), setpoint = plant.setpoint();
    if (sensor() && tooOld(plant, reference)) {
      tracker_.hold(q, setpoint, planning::TrackStatus::kSensor, track_);
      return false;
    }
    tracker_.step(q, setpoint, reference, sensor() ? &plant.measuredTips() : nullptr, track_);
    if (track_.status == planning::TrackStatus::kModel)
      throw std::runtime_error(std::string(kinematics::describe(track_.model)));
    return true;
  }
  const control::Solution& solution() const { return track_.solution; }

 private:
  static planning::ReferenceTracker make(const config::Robot& robot,
                                         const RobotModel& model,
                                         control::Method method,
                                         const LoopOptions& options) {
    control::MethodParameters parameters = robot.parameters;
    parameters.period = options.control_period;
    return {model.models(), model.limits(), method, parameters, options.gains};
  }

  bool sensor() const { return options_.feedback == planning::Feedback::kSensor; }
  bool tooOld(const Plant& plant, const planning::Reference& reference) const {
    bool old = false;
    planning::forEachArm(reference, [&](int k) {
      const auto& tip = plant.measuredTips().arm[static_cast<std::size_t>(k)];
      const double age = 1e-9 * static_cast<double>(plant.time() - tip.stamp);
      old = old || !tip.known || age > options_.budgets.tipAge(options_.control_period);
    });
    return old;
  }

  const LoopOptions& options_;
  planning::ReferenceTracker tracker_;
  planning::TrackResult track_;
};

}  // namespace

LoopOptions loopOptions(const config::Deployment& deployment, const config::Experiment& experiment) {
  return {deployment.control_period,
          {experiment.relative_gain, experiment.tip_gain},
          deployment.feedback,
          deployment.plant,
          deployment.budgets};
}

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
                     const LoopOptions& options,
                     const std::function<void(int, int)>& progress) {
  if (options.feedback == planning::Feedback::kSensor && !options.plant.tracker.present)
    throw std::runtime_error("feedback: sensor needs a tip tracker, plant.tracker");
  Plant plant(robot, model, plan.start, options);
  Controller controller(robot, model, plan.key.method, options);
  planning::Follower follower(options.control_period);
  RunRecord record(plan.key, model, plan.trajectory.point_count, plan.trajectory.tolerance);
  const auto see = [&] { return controller.see(plant, plan.trajectory.arm, plan.trajectory.other_arm); };

  auto [tip, relative] = see();
  follower.start(plan.trajectory, tip, relative);
  StepFacts facts;
  while (follower.update(tip, relative, facts.reference)) {
    const std::uint64_t actions = plant.gateActions();
    const bool moving = controller.step(plant, facts.reference);
    const control::Solution& solution = controller.solution();
    plant.move(solution.velocity, moving);
    facts.point = follower.progress().point;
    facts.iteration = follower.progress().iteration;
    facts.position = plant.position();
    for (int k = 0; k < model.armCount(); ++k)
      facts.tip[static_cast<std::size_t>(k)] = plant.tips().pose(k).translation();
    facts.scale = {solution.scale[0], solution.scale[1]};
    facts.solver_iterations = static_cast<std::uint32_t>(solution.iterations);
    facts.active_limits = static_cast<std::uint32_t>(solution.active_count);
    facts.gate_actions = plant.gateActions() - actions;
    record.add(facts);
    std::tie(tip, relative) = see();
    if (progress)
      progress(facts.point, plan.trajectory.point_count);
  }
  return record;
}

}  // namespace tandem::experiments
