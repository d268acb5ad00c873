// SPDX-License-Identifier: Apache-2.0
#include "experiments/montecarlo.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tandem::experiments {
namespace {

constexpr double kRotationPerTranslation = 100.0;  // backlash and noise, rad per m

sim::EncoderOptions encodersOf(const Conditions& conditions, sim::EncoderOptions encoders) {
  if (conditions.encoder_counts > 0.0)
    encoders.resolution = {1e-3 / conditions.encoder_counts, 2.0 * std::numbers::pi / conditions.encoder_counts};
  return conditions.encoder_noise > 0.0 ? withEncoderNoise(encoders, conditions.encoder_noise) : encoders;
}

void addContact(const Conditions& conditions, sim::PlantOptions& plant) {
  if (conditions.friction > 0.0)
    plant.friction = conditions.friction;
  if (conditions.clearance > 0.0)
    plant.clearance = conditions.clearance;
  if (conditions.ovality > 0.0)
    plant.ovality = conditions.ovality;
  if (conditions.residual > 0.0)
    plant.tube_deviation.residual_curvature = conditions.residual;
}

void addTrackerErrors(const Conditions& conditions, double period, sim::TipTrackerOptions& tracker) {
  if (conditions.tip_noise > 0.0)
    tracker.position_noise = conditions.tip_noise;
  if (conditions.bias > 0.0)
    tracker.bias.setConstant(conditions.bias / std::numbers::sqrt3);
  if (conditions.distortion > 0.0)
    tracker.distortion = conditions.distortion;
  if (conditions.tip_delay > 0.0)
    tracker.delay_variation = conditions.tip_delay * period;
}

/// The loop of one case and task: everything random depends on the seed and the task alone.
LoopOptions withErrors(LoopOptions options, const Conditions& conditions, std::uint64_t seed) {
  sim::PlantOptions& plant = options.plant;
  plant.seed = seed;
  if (conditions.stiffness > 0.0)
    plant.tube_deviation.bending_stiffness = plant.tube_deviation.torsional_stiffness = conditions.stiffness;
  if (conditions.curvature > 0.0)
    plant.tube_deviation.curvature = conditions.curvature;
  if (conditions.length > 0.0)
    plant.tube_deviation.length = conditions.length;
  addContact(conditions, plant);
  plant.encoders = encodersOf(conditions, plant.encoders);
  if (conditions.backlash > 0.0)
    plant.mechanics.backlash = {conditions.backlash, kRotationPerTranslation * conditions.backlash};
  if (conditions.delay_steps > 0.0)
    plant.mechanics.delay = conditions.delay_steps * options.control_period;
  if (options.feedback == planning::Feedback::kSensor && !plant.tracker.present) {
    plant.tracker.present = true;
    plant.tracker.rate = 1.0 / options.control_period;
  }
  addTrackerErrors(conditions, options.control_period, plant.tracker);
  return options;
}

constexpr int kSteady = 50;    // periods for which the reference of timed tracking stands still at the end
constexpr int kSettling = 25;  // of those, left out of the steady-state error

/// Errors of timed tracking. A reference belongs to the time before the step that answers it: the tip is that of the
/// row before. @param whole  the run got to the end of its standstill
void measureTracking(const std::vector<Row>& rows, bool whole, double threshold, TaskResult& result) {
  const std::size_t steady = whole ? rows.size() - kSteady : rows.size();  // its first row
  std::vector<double> ab, a, steady_ab, steady_a;
  for (std::size_t i = 1; i < std::min(steady + 1, rows.size()); ++i) {
    const auto [error_ab, error_a] = errorsOf(rows[i].data.reference, rows[i - 1].data.tip);
    ab.push_back(error_ab);
    a.push_back(error_a);
    result.converged += ab.back() <= threshold && a.back() <= threshold ? 1 : 0;
  }
  for (std::size_t i = steady + kSettling; i < rows.size(); ++i) {
    steady_ab.push_back(rows[i].error_ab);
    steady_a.push_back(rows[i].error_a);
  }
  result.points = static_cast<int>(ab.size());
  result.ab = statisticsOf(ab);
  result.a = statisticsOf(a);
  result.steady_ab = statisticsOf(steady_ab).rms;
  result.steady_a = statisticsOf(steady_a).rms;
}

TaskResult runMethod(const config::Robot& robot,
                     const RobotModel& model,
                     const LoopOptions& options,
                     RunPlan plan,
                     TaskResult result) {
  const double threshold = plan.trajectory.tolerance;
  const double within = result.conditions.stop_within > 0.0 ? result.conditions.stop_within : threshold;
  const bool timed = result.conditions.speed > 0.0;
  plan.trajectory.tolerance = within;
  for (planning::FurtherTask& task : plan.trajectory.further)
    task.tolerance = within / kinematics::findTaskKind(task.kind)->length();
  if (timed) {
    plan.trajectory.following = planning::Following::kTimed;
    plan.trajectory.speed = result.conditions.speed;
    plan.trajectory.tolerance = 0.0;  // the reference stands still for all of kSteady
    plan.trajectory.max_iterations = kSteady;
  }
  RunRecord record(plan.key, model, plan.trajectory.point_count, threshold);
  int point = 0;
  try {
    const planning::Progress end = runLoop(robot, model, plan, options, [&](const LoopView& view) {
      record.add(view.data);
      result.held += view.held ? 1 : 0;
      if (view.data.point != point)  // in every iteration it would be most of the time of a run
        result.contacts += view.robot.tips().clearance() < 0.0 ? 1 : 0;
      point = view.data.point;
      for (int k = 0; k < model.armCount(); ++k)
        result.stability = std::min(result.stability, view.robot.tips().stability(k));
      const sim::Snaps snaps = view.robot.tips().allSnaps();
      result.snaps = static_cast<int>(snaps.count);
      result.snap_energy = snaps.energy;
      result.snap_distance = snaps.distance;
    });
    const bool completed =
        timed ? end.tip_error <= within && end.relative_error <= within : end.phase == planning::Phase::kFinished;
    result.outcome = completed ? Outcome::kCompleted : Outcome::kNotConverged;
  } catch (const std::runtime_error& error) {
    result.outcome = Outcome::kRefused;
    result.reason = error.what();
    std::ranges::replace(result.reason, ',', ';');
  }
  const RunSummary summary = record.summary();
  result.iterations = summary.iterations;
  result.violations = summary.limit_violations;
  result.gate_actions = summary.gate_actions;
  if (!summary.further.empty())
    result.further_error = summary.further.front().errors;
  if (timed) {
    measureTracking(record.rows(), result.outcome != Outcome::kRefused, threshold, result);
    return result;
  }
  result.points = summary.points;
  result.converged = summary.converged;
  result.ab = summary.ab;
  result.a = summary.a;
  return result;
}

}  // namespace

std::string_view name(Outcome outcome) {
  constexpr std::array<std::string_view, 3> kNames{"completed", "not-converged", "refused"};
  return kNames[static_cast<std::size_t>(outcome)];
}

sim::EncoderOptions withEncoderNoise(sim::EncoderOptions encoders, double noise) {
  encoders.noise = {noise, kRotationPerTranslation * noise};
  return encoders;
}

sim::EncoderOptions worstEncoders(const MonteCarlo& run, const sim::EncoderOptions& otherwise) {
  sim::EncoderOptions worst = otherwise;
  const auto grow = [](sim::PerAxisKind& size, const sim::PerAxisKind& to) {
    size = {std::max(size.translation, to.translation), std::max(size.rotation, to.rotation)};
  };
  for (const Conditions& conditions : run.cases) {
    const sim::EncoderOptions encoders = encodersOf(conditions, otherwise);
    grow(worst.resolution, encoders.resolution);
    grow(worst.noise, encoders.noise);
  }
  return worst;
}

bool outOfReach(const MonteCarlo& run, int index) {
  return std::floor((index + 1) * run.infeasible) > std::floor(index * run.infeasible);
}

std::vector<TaskResult> runTask(const config::Robot& robot,
                                const RobotModel& model,
                                const LoopOptions& options,
                                const MonteCarlo& run,
                                std::size_t error_case,
                                int index) {
  const Conditions& conditions = run.cases[error_case];
  const LoopOptions loop = withErrors(options, conditions, seedOf(run.seed, index));
  const control::MethodParameters& p = robot.parameters;
  RandomTask task = randomTask(robot, model, loop, std::min(p.rotation_velocity, p.snsqp_rotation_velocity), run.seed,
                               index, !outOfReach(run, index), run.further);
  if (run.posture)
    task.plan.postures = task.witness;
  std::vector<TaskResult> results;
  for (const control::Method method : run.methods) {
    task.plan.key.method = method;
    TaskResult result;
    result.seed = run.seed;
    result.tasks = run.tasks;
    result.task = index;
    result.method = method;
    result.conditions = conditions;
    result.kind = task.kind;
    result.feasible = task.feasible;
    result.further = run.further;
    results.push_back(runMethod(robot, model, loop, task.plan, result));
  }
  return results;
}

}  // namespace tandem::experiments
