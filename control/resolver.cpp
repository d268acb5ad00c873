// SPDX-License-Identifier: Apache-2.0
#include "control/resolver.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "control/methods.h"

namespace tandem::control {
namespace {

/// A velocity this near to its bound stands at it, m/s or rad/s.
constexpr double kAtBound = 1e-10;

bool finite(const StepProblem& problem) {
  for (int j = 0; j < problem.joint_count; ++j) {
    if (!std::isfinite(problem.joint[j].position))
      return false;
  }
  for (int k = 0; k < problem.task_count; ++k) {
    if (!problem.task[k].jacobian.allFinite() || !problem.task[k].velocity.allFinite())
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

void requirePositive(double value, const char* what) {
  if (!(value > 0.0) || !std::isfinite(value)) {
    throw std::invalid_argument(std::string(what) + ": found " + std::to_string(value) +
                                ", expected a finite number above zero");
  }
}

}  // namespace

std::string_view describe(SolveStatus status) {
  switch (status) {
    case SolveStatus::kSolved:
      return "ok";
    case SolveStatus::kInfeasible:
      return "infeasible: the limits leave no velocity that does the task";
    case SolveStatus::kIterationLimit:
      return "the solver ran out of iterations";
    case SolveStatus::kNotFinite:
      return "a number in the problem is not finite";
    case SolveStatus::kFailed:
      return "the solver failed";
  }
  return "unknown";
}

void Resolver::solve(const StepProblem& problem, Solution& solution) noexcept {
  const int n = problem.joint_count;
  solution.velocity.setZero(n);
  solution.scale.fill(0.0);
  solution.residual.fill(0.0);
  solution.iterations = 0;
  solution.kkt_residual = 0.0;
  solution.joint_active.fill(0);
  solution.active_count = 0;
  solution.bounds.lower.setConstant(n, -safety::kUnlimited);
  solution.bounds.upper.setConstant(n, safety::kUnlimited);
  solution.bounds.row_count = 0;

  solution.status = finite(problem) ? resolve(problem, solution) : SolveStatus::kNotFinite;
  if (solution.status == SolveStatus::kSolved && !solution.velocity.allFinite())
    solution.status = SolveStatus::kFailed;
  if (solution.status != SolveStatus::kSolved) {
    solution.velocity.setZero(n);
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

std::unique_ptr<Resolver> makeResolver(Method method, const MethodParameters& p) {
  requirePositive(p.period, "period");
  requirePositive(p.nsp_damping, "damping");
  requirePositive(p.track_weight, "track_weight");
  requirePositive(p.translation_weight, "translation_weight");
  requirePositive(p.rotation_weight, "rotation_weight");
  requirePositive(p.nspqp_zeta, "zeta");
  requirePositive(p.snsqp_zeta, "zeta");
  requirePositive(p.snsqp_rotation_velocity, "snsqp_rotation_velocity");
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
  }
  throw std::invalid_argument("unknown method");
}

}  // namespace tandem::control
