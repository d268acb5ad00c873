// SPDX-License-Identifier: Apache-2.0
#include "experiments/closed_loop.h"

#include <algorithm>
#include <stdexcept>

#include "experiments/simulated_robot.h"
#include "planning/insertion.h"

namespace tandem::experiments {
namespace {

/** Control of one run: which tips it believes, and its step. */
class Controller {
 public:
  Controller(const config::Robot& robot, const RobotModel& model, control::Method method, const LoopOptions& options)
      : options_(options), tracker_(make(robot, model, method, options)) {}

  /// Tips that planning uses for this state, as in its own process.
  const planning::TipFollower& see(const SimulatedRobot& plant) {
    if (!tracker_.computeTips(plant.position(), track_))
      refuse();
    return tracker_.tips();
  }
  const planning::MeasuredTips* measured(const SimulatedRobot& plant) const {
    return sensor() ? &plant.measuredTips() : nullptr;
  }

  /// @return whether the arms move in this period.
  bool step(const SimulatedRobot& plant, const planning::Reference& reference) {
    const safety::RobotVector q = plant.position(), setpoint = plant.setpoint();
    if (sensor() && tooOld(plant, reference)) {
      tracker_.hold(q, setpoint, planning::TrackStatus::kSensor, track_);
      return false;
    }
    tracker_.step(q, setpoint, reference, measured(plant), track_);
    if (track_.status == planning::TrackStatus::kModel)
      refuse();
    return true;
  }
  const control::Solution& solution() const { return track_.solution; }

 private:
  [[noreturn]] void refuse() const {
    throw std::runtime_error("no tip of the controlled arms at these joints: " +
                             std::string(kinematics::describe(track_.model)));
  }
  static planning::ReferenceTracker make(const config::Robot& robot,
                                         const RobotModel& model,
                                         control::Method method,
                                         const LoopOptions& options) {
    control::MethodParameters parameters = robot.parameters;
    parameters.period = options.control_period;
    return {model.models(), model.limits(), method, parameters, options.gains};
  }

  bool sensor() const { return options_.feedback == planning::Feedback::kSensor; }
  bool tooOld(const SimulatedRobot& plant, const planning::Reference& reference) const {
    bool old = false;
    planning::forEachArm(reference, [&](int k, bool with_orientation) {
      const double age = planning::measuredAge(plant.measuredTips(), k, with_orientation, [&](const auto& origin) {
        return 1e-9 * static_cast<double>(plant.time() - origin.stamp);
      });
      old = old || age > options_.budgets.tipAge(options_.control_period);
    });
    return old;
  }

  const LoopOptions& options_;
  planning::ReferenceTracker tracker_;
  planning::TrackResult track_;
};

}  // namespace

LoopOptions loopOptions(const config::Deployment& deployment, const config::Experiment& experiment) {
  return {deployment.control_period, {experiment.relative_gain, experiment.tip_gain},
          deployment.feedback,       deployment.orientation_feedback,
          deployment.plant,          deployment.budgets};
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
            throw std::invalid_argument("trajectory " + name + ": found configuration '" + wanted +
                                        "', expected one of those under `configurations`");
          runs.push_back({{name, wanted, method}, trajectory.spec, found->joints});
        }
      }
    }
  }
  return runs;
}

config::Robot withoutGate(config::Robot& robot) {
  for (config::Arm& arm : robot.arms)
    arm.model.tolerance = safety::kUnlimited;
  config::Robot plant = robot;
  for (config::Arm& arm : plant.arms) {
    arm.limits.rows.clear();
    for (safety::JointLimit& joint : arm.limits.joints) {
      safety::JointLimit free;
      free.kind = joint.kind;
      free.max_step = joint.max_step;
      joint = free;
    }
  }
  return plant;
}

planning::Progress runLoop(const config::Robot& robot,
                           const RobotModel& model,
                           const RunPlan& plan,
                           const LoopOptions& options,
                           const std::function<void(const LoopView&)>& after) {
  if (options.feedback == planning::Feedback::kSensor && !options.plant.tracker.present)
    throw std::invalid_argument("found feedback: sensor without a simulated tip tracker, expected plant.tracker");
  if (options.orientation_feedback == planning::Feedback::kSensor && options.feedback != planning::Feedback::kSensor)
    throw std::invalid_argument("found orientation_feedback: sensor with feedback: model, expected feedback: sensor");
  if (const std::string wrong = plan.trajectory.wrongArms(model.armCount()); !wrong.empty())
    throw std::invalid_argument("trajectory " + plan.trajectory.name + ": " + wrong);
  if (const std::string wrong = plan.trajectory.wrongModels(model.models()); !wrong.empty())
    throw std::invalid_argument("trajectory " + plan.trajectory.name + ": " + wrong);
  SimulatedRobot plant(robot, model, plan.start, options);
  Controller controller(robot, model, plan.key.method, options);
  planning::Follower follower(options.control_period);
  planning::TrajectorySpec trajectory = plan.trajectory;
  planning::setInsertion({model.models(), model.limits()}, plant.position(), trajectory);
  const planning::TrajectoryPoint at = planning::pointAt(trajectory, controller.see(plant), controller.measured(plant));
  if (plan.points.empty())
    follower.start(trajectory, at, plan.postures);
  else
    follower.startAt(trajectory, at, plan.points, plan.postures);
  StepData data;
  while (follower.update(controller.see(plant), controller.measured(plant), data.reference)) {
    const std::uint64_t actions = plant.gateActions();
    const bool moving = controller.step(plant, data.reference);
    const control::Solution& solution = controller.solution();
    plant.move(solution.velocity, moving);
    data.point = follower.progress().point;
    data.iteration = follower.progress().iteration;
    data.position = plant.position();
    data.setpoint = plant.setpoint();
    for (int k = 0; k < model.armCount(); ++k) {
      data.tip[static_cast<std::size_t>(k)] = plant.tips().pose(k).translation();
      data.orientation[static_cast<std::size_t>(k)] = plant.tips().pose(k).linear();
    }
    data.scale = solution.scale;
    data.solver_iterations = static_cast<std::uint32_t>(solution.iterations);
    data.active_limits = static_cast<std::uint32_t>(solution.active_count);
    data.gate_actions = plant.gateActions() - actions;
    after({data, plant, follower.progress(), !moving});
  }
  return follower.progress();
}

RunRecord runOffline(const config::Robot& robot,
                     const RobotModel& model,
                     const RunPlan& plan,
                     const LoopOptions& options,
                     const std::function<void(int, int)>& progress) {
  RunRecord record(plan.key, model, plan.trajectory.point_count, plan.trajectory.tolerance);
  try {
    runLoop(robot, model, plan, options, [&](const LoopView& view) {
      record.add(view.data);
      record.setSnaps(view.robot.tips().allSnaps());
      if (progress)
        progress(view.data.point, plan.trajectory.point_count);
    });
  } catch (const std::runtime_error& error) {
    record.fail(error.what());
  }
  return record;
}

}  // namespace tandem::experiments
