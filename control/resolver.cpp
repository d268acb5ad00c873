// SPDX-License-Identifier: Apache-2.0
#include "control/resolver.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "control/foreign_method.h"
#include "control/methods.h"

namespace tandem::control {
namespace {

/// A velocity this near to its bound is at it, m/s or rad/s.
constexpr double kAtBound = 1e-10;

bool isFinite(const StepProblem& problem) {
  for (int j = 0; j < problem.joint_count; ++j) {
    if (!std::isfinite(problem.joint[j].position))
      return false;
  }
  if (problem.posture.size() > 0 && (problem.posture.size() != problem.joint_count || !problem.posture.allFinite()))
    return false;
  for (int i = 0; i < problem.barrier_count; ++i) {
    if (!problem.barrier[i].gradient.allFinite() || !std::isfinite(problem.barrier[i].rate))
      return false;
  }
  for (int k = 0; k < problem.task_count; ++k) {
    const Task& task = problem.task[k];
    if (!task.jacobian.allFinite() || !task.velocity.allFinite() || !std::isfinite(task.activation))
      return false;
  }
  return true;
}

void markActive(const StepProblem& problem, Solution& solution) {
  const RobotVector& v = solution.velocity;
  const VelocityBounds& bounds = solution.bounds;
  for (int j = 0; j < problem.joint_count; ++j) {
    const bool at = v[j] - bounds.lower[j] < kAtBound || bounds.upper[j] - v[j] < kAtBound;
    solution.joint_active[j] = at ? 1 : 0;
    solution.active_count += at ? 1 : 0;
  }
  for (int i = 0; i < bounds.row_count; ++i) {
    const CoupledRow& row = problem.row[i];
    if (bounds.row_rate[i] - (row.a_first * v[row.first] + row.a_second * v[row.second]) >= kAtBound)
      continue;
    solution.joint_active[row.first] = solution.joint_active[row.second] = 1;
    ++solution.active_count;
  }
}

/// Scales the whole velocity so that no rotation is faster than `limit`, rad/s: methods without limits would rotate
/// tubes without bound near singular poses.
void slowDown(const StepProblem& problem, double limit, RobotVector& velocity) {
  double fastest = 0.0;
  for (int j = 0; j < problem.joint_count; ++j) {
    if (problem.joint[j].kind == JointKind::kRotation)
      fastest = std::max(fastest, std::abs(velocity[j]));
  }
  if (fastest > limit)
    velocity *= limit / fastest;
}

/** Removes violations of rows by rounding, so that they do not reach the joints: with many dependent limits and tasks
 * they are negligible for motion, but larger than the gate's rounding tolerance. Each row moves its first joint, as far
 * as the bounds allow, then its second; neighbouring rows transfer the change. */
void tidy(const StepProblem& problem, Solution& solution) {
  constexpr double kRounding = 1e-8;  // m/s; larger violations (methods without rows) are left to the gate
  constexpr int kPasses = 4;
  const VelocityBounds& bounds = solution.bounds;
  for (int pass = 0; pass < kPasses; ++pass) {
    bool changed = false;
    for (int i = 0; i < bounds.row_count; ++i) {
      const CoupledRow& row = problem.row[i];
      for (const auto& [joint, a] : {std::pair{row.first, row.a_first}, std::pair{row.second, row.a_second}}) {
        const double excess = row.a_first * solution.velocity[row.first] +
                              row.a_second * solution.velocity[row.second] - bounds.row_rate[i];
        if (!(excess > 0.0 && excess < kRounding) || a == 0.0)
          continue;
        double& velocity = solution.velocity[joint];
        velocity = std::clamp(velocity - excess / a, bounds.lower[joint], bounds.upper[joint]);
        changed = true;
      }
    }
    if (!changed)
      return;
  }
}

/** If all tubes of an arm lie in one plane, rotations move the tip only out of that plane. A task within the plane that
 * translations cannot do then has no gradient in the rotations: a saddle, at which every method would stay. This
 * rotates neighbouring tubes apart by a small angle, after which the task itself moves them further. */
void leaveSaddle(const StepProblem& problem, double period, double limit, Solution& solution) {
  constexpr double kUndone = 0.05;   // of a wanted velocity
  constexpr double kNoLever = 1e-6;  // projection of a rotation's column on the task residual, relative to both norms
  constexpr double kOffset = 1e-4;   // rad
  constexpr double kSlow = 1e-9;     // wanted velocities below this are rounding, m/s
  for (int k = 0; k < problem.task_count; ++k) {
    const Task& task = problem.task[k];
    const TaskVector undone = task.velocity - task.jacobian.lazyProduct(solution.velocity);
    const double wanted = task.velocity.norm(), rest = undone.norm();
    if (rest < kUndone * wanted || wanted < kSlow)
      continue;
    for (int arm = 0; arm < problem.arm_count; ++arm) {
      const int begin = problem.arm_offset[arm], end = problem.arm_offset[arm + 1];
      double lever = 0.0, size = 0.0;
      for (int j = begin; j < end; ++j) {
        if (problem.joint[j].kind != JointKind::kRotation)
          continue;
        lever = std::max(lever, std::abs(task.jacobian.col(j).dot(undone)));
        size = std::max(size, task.jacobian.col(j).norm());
      }
      if (size == 0.0 || lever > kNoLever * size * rest)
        continue;
      const double speed = std::min(limit, kOffset / period);
      for (int j = begin, sign = 1; j < end; ++j) {
        if (problem.joint[j].kind != JointKind::kRotation)
          continue;
        solution.velocity[j] =
            std::clamp(solution.velocity[j] + sign * speed, solution.bounds.lower[j], solution.bounds.upper[j]);
        sign = -sign;
      }
    }
  }
}

void requirePositive(double value, const char* what) {
  if (!(value > 0.0) || !std::isfinite(value)) {
    throw std::invalid_argument(std::string(what) + ": found " + std::to_string(value) +
                                ", expected a finite number above zero");
  }
}

void requireNotNegative(double value, const char* what) {
  if (!(value >= 0.0) || !std::isfinite(value)) {
    throw std::invalid_argument(std::string(what) + ": found " + std::to_string(value) +
                                ", expected a finite number not below zero");
  }
}

}  // namespace

void Resolver::solve(const StepProblem& problem, Solution& solution) noexcept {
  const bool all = std::all_of(problem.task.begin(), problem.task.begin() + problem.task_count,
                               [](const Task& task) { return task.activation >= 1.0; });
  if (all || !isFinite(problem))
    solveList(problem, solution);
  else
    blend(problem, solution);
  if (solution.status != SolveStatus::kSolved && solution.status != SolveStatus::kInfeasible) {
    solution.velocity.setZero(problem.joint_count);
    solution.scale.fill(0.0);
    return;
  }
  for (int k = 0; k < problem.task_count; ++k) {
    const Task& task = problem.task[k];
    double squares = 0.0;
    for (int i = 0; i < task.velocity.size(); ++i) {
      const double error = task.jacobian.row(i).dot(solution.velocity) - task.velocity[i];
      squares += error * error;
    }
    solution.residual[k] = std::sqrt(squares);
  }
  markActive(problem, solution);
}

/// Status, velocity, scales, bounds and conflict for the tasks as they are.
void Resolver::solveList(const StepProblem& problem, Solution& solution) noexcept {
  const int n = problem.joint_count;
  solution.velocity.setZero(n);
  solution.scale.fill(0.0);
  solution.residual.fill(0.0);
  solution.iterations = 0;
  solution.kkt_residual = 0.0;
  solution.joint_active.fill(0);
  solution.active_count = 0;
  solution.conflict.count = 0;
  solution.bounds.lower.setConstant(n, -safety::kUnlimited);
  solution.bounds.upper.setConstant(n, safety::kUnlimited);
  solution.bounds.row_count = 0;

  solution.status = isFinite(problem) ? resolve(problem, solution) : SolveStatus::kNotFinite;
  if (solution.velocity.size() != n || !solution.velocity.allFinite())
    solution.status = SolveStatus::kFailed;
  if (solution.status != SolveStatus::kSolved && solution.status != SolveStatus::kInfeasible)
    return;
  leaveSaddle(problem, parameters_.period, parameters_.rotation_velocity, solution);
  slowDown(problem, parameters_.rotation_velocity, solution.velocity);
  tidy(problem, solution);
}

/// The same without tasks, by bits of their indices; the scale of one that is left out is 1.
void Resolver::solveSubset(const StepProblem& problem, unsigned without, Solution& solution) noexcept {
  subset_ = problem;
  subset_.task_count = 0;
  for (int k = 0; k < problem.task_count; ++k) {
    if ((without >> k & 1U) == 0)
      subset_.task[subset_.task_count++] = problem.task[k];
  }
  solveList(subset_, solution);
  for (int k = problem.task_count, from = subset_.task_count; k-- > 0;)
    solution.scale[k] = (without >> k & 1U) == 0 ? solution.scale[--from] : 1.0;
}

/// The sum over all subsets. All else is that of the longest list, which is solved last.
void Resolver::blend(const StepProblem& problem, Solution& solution) noexcept {
  const unsigned lists = 1U << problem.task_count;
  RobotVector sum = RobotVector::Zero(problem.joint_count);
  int iterations = 0;
  double residual = 0.0;
  for (unsigned without = lists; without-- > 0;) {
    double weight = 1.0;
    for (int k = 0; k < problem.task_count; ++k) {
      const double h = std::clamp(problem.task[k].activation, 0.0, 1.0);
      weight *= (without >> k & 1U) == 0 ? h : 1.0 - h;
    }
    if (!(weight > 0.0))
      continue;
    solveSubset(problem, without, solution);
    if (solution.status != SolveStatus::kSolved && solution.status != SolveStatus::kInfeasible)
      return;
    sum += weight * solution.velocity;
    iterations += solution.iterations;
    residual = std::max(residual, solution.kkt_residual);
  }
  solution.velocity = sum;
  solution.iterations = iterations;
  solution.kkt_residual = residual;
}

std::unique_ptr<Resolver> makeResolver(Method method, const MethodParameters& p) {
  requirePositive(p.period, "period");
  for (const TunableParameter& parameter : kTunableParameters)
    requirePositive(p.*parameter.member, parameter.name);
  requireNotNegative(p.least_stability, "least_stability");
  requireNotNegative(p.least_distance, "least_distance");
  switch (method) {
    case Method::kNsp:
      return makeNsp(p);
    case Method::kNspwln:
      return makeNspwln(p);
    case Method::kNspwlnJoint:
      return makeNspwlnJoint(p);
    case Method::kNspqp:
      return makeNspqp(p);
    case Method::kSnsqp:
      return makeSnsqp(p);
    case Method::kSns:
      return makeSns(p);
    case Method::kHqp:
      return makeHqp(p);
    case Method::kForeign:
      if (p.foreign == nullptr)
        throw std::invalid_argument("method foreign: found no library, expected one (key method_library)");
      return p.foreign->make(p);
  }
  throw std::invalid_argument("unknown method");
}

}  // namespace tandem::control
