// SPDX-License-Identifier: Apache-2.0
#include "experiments/montecarlo.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "experiments/csv.h"
#include "experiments/detail/format.h"

namespace tandem::experiments {
namespace {

constexpr double kRotationPerTranslation = 100.0;  // backlash and noise, rad per m

sim::EncoderOptions encodersOf(const ErrorSizes& errors, sim::EncoderOptions encoders) {
  if (errors.encoder_counts > 0.0)
    encoders.resolution = {1e-3 / errors.encoder_counts, 2.0 * std::numbers::pi / errors.encoder_counts};
  return errors.encoder_noise > 0.0 ? withEncoderNoise(encoders, errors.encoder_noise) : encoders;
}

/// The loop of one case and task: everything random depends on the seed and the task alone.
LoopOptions withErrors(LoopOptions options, const ErrorSizes& errors, std::uint64_t seed) {
  sim::PlantOptions& plant = options.plant;
  plant.seed = seed;
  if (errors.stiffness > 0.0)
    plant.tube_deviation.bending_stiffness = plant.tube_deviation.torsional_stiffness = errors.stiffness;
  if (errors.curvature > 0.0)
    plant.tube_deviation.curvature = errors.curvature;
  if (errors.length > 0.0)
    plant.tube_deviation.length = errors.length;
  plant.encoders = encodersOf(errors, plant.encoders);
  if (errors.play > 0.0)
    plant.mechanics.backlash = {errors.play, kRotationPerTranslation * errors.play};
  if (errors.delay_steps > 0.0)
    plant.mechanics.delay = errors.delay_steps * options.control_period;
  if (options.feedback == planning::Feedback::kSensor && !plant.tracker.present) {
    plant.tracker.present = true;
    plant.tracker.rate = 1.0 / options.control_period;
  }
  if (errors.tip_noise > 0.0)
    plant.tracker.position_noise = errors.tip_noise;
  return options;
}

TaskResult runMethod(const config::Robot& robot,
                     const RobotModel& model,
                     const LoopOptions& options,
                     const RunPlan& plan,
                     TaskResult result) {
  RunRecord record(plan.key, model, plan.trajectory.point_count, plan.trajectory.tolerance);
  try {
    const planning::Progress end = runLoop(robot, model, plan, options, [&](const LoopView& view) {
      record.add(view.data);
      result.held += view.held ? 1 : 0;
      result.snaps = 0;
      for (int k = 0; k < model.armCount(); ++k) {
        result.stability = std::min(result.stability, view.robot.tips().stability(k));
        result.snaps += static_cast<int>(view.robot.tips().snaps(k));
      }
    });
    result.outcome = end.phase == planning::Phase::kFinished ? Outcome::kCompleted : Outcome::kNotConverged;
  } catch (const std::runtime_error&) {
    result.outcome = Outcome::kRefused;
  }
  const RunSummary summary = record.summary();
  result.points = summary.points;
  result.converged = summary.converged;
  result.iterations = summary.iterations;
  result.ab = summary.ab;
  result.a = summary.a;
  result.violations = summary.limit_violations;
  result.gate_actions = summary.gate_actions;
  return result;
}

/// 50th, 90th and 99th: the smallest value that so many do not exceed.
std::array<double, 3> percentiles(std::vector<double> values) {
  if (values.empty())
    return {std::nan(""), std::nan(""), std::nan("")};
  std::sort(values.begin(), values.end());
  const auto at = [&](double part) {
    const auto rank = static_cast<std::size_t>(std::ceil(part * static_cast<double>(values.size())));
    return values[std::max<std::size_t>(rank, 1) - 1];
  };
  return {at(0.5), at(0.9), at(0.99)};
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
  for (const ErrorSizes& errors : run.cases) {
    const sim::EncoderOptions encoders = encodersOf(errors, otherwise);
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
  const ErrorSizes& errors = run.cases[error_case];
  const LoopOptions loop = withErrors(options, errors, seedOf(run.seed, index));
  const control::MethodParameters& p = robot.parameters;
  RandomTask task = randomTask(robot, model, loop, std::min(p.rotation_velocity, p.snsqp_rotation_velocity), run.seed,
                               index, !outOfReach(run, index));
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
    result.errors = errors;
    result.kind = task.kind;
    result.feasible = task.feasible;
    results.push_back(runMethod(robot, model, loop, task.plan, result));
  }
  return results;
}

std::vector<MethodSummary> summarise(const std::vector<TaskResult>& results) {
  struct Values {
    std::vector<double> iterations, ab, a;
  };
  std::vector<MethodSummary> rows;
  std::vector<Values> values;
  for (const TaskResult& r : results) {
    auto found = std::find_if(rows.begin(), rows.end(), [&](const MethodSummary& row) {
      return row.errors == r.errors && row.method == r.method;
    });
    if (found == rows.end()) {
      found = rows.insert(rows.end(), MethodSummary{});
      found->errors = r.errors;
      found->method = r.method;
      values.emplace_back();
    }
    MethodSummary& row = *found;
    Values& all = values[static_cast<std::size_t>(found - rows.begin())];
    row.violations += r.violations;
    row.gate_actions += r.gate_actions;
    row.stability = std::min(row.stability, r.stability);
    row.snaps += r.snaps;
    if (!r.feasible) {
      ++row.infeasible;
      row.reported += r.outcome != Outcome::kCompleted ? 1 : 0;
      continue;
    }
    ++row.feasible;
    all.ab.push_back(r.ab.rms);
    all.a.push_back(r.a.rms);
    if (r.succeeded()) {
      ++row.succeeded;
      all.iterations.push_back(static_cast<double>(r.iterations) / r.points);
    }
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].iterations = percentiles(std::move(values[i].iterations));
    rows[i].ab = percentiles(std::move(values[i].ab));
    rows[i].a = percentiles(std::move(values[i].a));
  }
  return rows;
}

std::string describe(const ErrorSizes& errors) {
  std::string text;
  for (const ErrorSource& source : kErrorSources) {
    const double size = errors.*source.member / source.unit;
    if (size == 0.0)
      continue;
    text += (text.empty() ? "" : ", ") + std::string(source.name) + " ";
    text += source.relative ? format("%g%%", 100.0 * size) : format("%g", size);
  }
  return text.empty() ? "no errors" : text;
}

std::string formatTable(const std::vector<MethodSummary>& rows) {
  std::string text;
  const ErrorSizes* shown = nullptr;
  for (const MethodSummary& row : rows) {
    if (shown == nullptr || !(*shown == row.errors)) {
      text += (shown == nullptr ? "" : "\n") + describe(row.errors) + "\n";
      text +=
          format("%-13s %17s %8s  %-17s %-21s %-21s %8s %6s %7s %9s %6s\n", "method", "succeeded", "%",
                 "iterations/point", "eps_AB RMS mm", "eps_A RMS mm", "outside", "gate", "margin", "no reach", "snaps");
      text += format("%-13s %17s %8s  %-17s %-21s %-21s\n", "", "of feasible", "", "p50 p90 p99", "p50 p90 p99",
                     "p50 p90 p99");
    }
    shown = &row.errors;
    const auto& n = row.iterations;
    const auto mm = [](const std::array<double, 3>& e) {
      return format("%.3f %.3f %.3f", 1e3 * e[0], 1e3 * e[1], 1e3 * e[2]);
    };
    text += format("%-13s %17s %8.2f  %-17s %-21s %-21s %8d %6llu %7.3f %9s %6d\n",
                   std::string(control::name(row.method)).c_str(),
                   (std::to_string(row.succeeded) + "/" + std::to_string(row.feasible)).c_str(), 100.0 * row.rate(),
                   format("%.1f %.1f %.1f", n[0], n[1], n[2]).c_str(), mm(row.ab).c_str(), mm(row.a).c_str(),
                   row.violations, static_cast<unsigned long long>(row.gate_actions), row.stability,
                   (std::to_string(row.reported) + "/" + std::to_string(row.infeasible)).c_str(), row.snaps);
  }
  return text;
}

}  // namespace tandem::experiments
