// SPDX-License-Identifier: Apache-2.0
#include "control/conflict.h"

#include <algorithm>
#include <cmath>

namespace tandem::control {
namespace {

struct Joint {
  int arm = 0;
  int tube = 0;  ///< counts from 1
  bool rotation = false;
};

Joint place(const StepProblem& problem, int joint) {
  Joint result;
  while (result.arm + 1 < problem.arm_count && joint >= problem.arm_offset[result.arm + 1])
    ++result.arm;
  result.rotation = problem.joint[joint].kind == JointKind::kRotation;
  for (int j = problem.arm_offset[result.arm]; j <= joint; ++j)
    result.tube += problem.joint[j].kind == problem.joint[joint].kind ? 1 : 0;
  return result;
}

}  // namespace

void explain(const StepProblem& problem,
             const VelocityBounds& bounds,
             const QpSolution& certificate,
             Conflict& conflict) noexcept {
  constexpr double kRounding = 1e-9;
  conflict.count = 0;
  double largest = 0.0;
  const auto add = [&](Conflict::Kind kind, int index, double weight, double bound) {
    if (!(weight > 0.0))
      return;
    largest = std::max(largest, weight);
    int at = std::min(conflict.count, Conflict::kMost);
    while (at > 0 && conflict.limit[at - 1].weight < weight)
      --at;
    if (at >= Conflict::kMost)
      return;
    conflict.count = std::min(conflict.count + 1, Conflict::kMost);
    for (int i = conflict.count - 1; i > at; --i)
      conflict.limit[i] = conflict.limit[i - 1];
    bool step = false;
    if (kind != Conflict::Kind::kRow) {
      const bool rotation = problem.joint[index].kind == JointKind::kRotation;
      const double most = rotation ? bounds.step_rotation : bounds.step_translation;
      step = std::abs(bound) >= most * (1.0 - kRounding);
    }
    conflict.limit[at] = {kind, index, weight, bound, step};
  };
  for (int j = 0; j < problem.joint_count; ++j) {
    add(Conflict::Kind::kUpper, j, certificate.z[j], bounds.upper[j]);
    add(Conflict::Kind::kLower, j, -certificate.z[j], bounds.lower[j]);
  }
  for (int i = 0; i < certificate.w.size(); ++i)
    add(Conflict::Kind::kRow, i, certificate.w[i], bounds.row_rate[i]);
  while (conflict.count > 0 && conflict.limit[conflict.count - 1].weight < kRounding * largest)
    --conflict.count;
}

void standingAt(const StepProblem& problem, const Solution& solution, Conflict& conflict) noexcept {
  constexpr double kAt = 1e-9;  // m/s, rad/s
  const RobotVector& v = solution.velocity;
  const VelocityBounds& bounds = solution.bounds;
  QpSolution weights;
  weights.z.setZero(problem.joint_count);
  weights.w.setZero(bounds.row_count);
  for (int j = 0; j < problem.joint_count; ++j)
    weights.z[j] = bounds.upper[j] - v[j] < kAt ? 1.0 : v[j] - bounds.lower[j] < kAt ? -1.0 : 0.0;
  for (int i = 0; i < bounds.row_count; ++i) {
    const CoupledRow& row = problem.row[i];
    const double rate = row.a_first * v[row.first] + row.a_second * v[row.second];
    weights.w[i] = bounds.row_rate[i] - rate < kAt ? 1.0 : 0.0;
  }
  explain(problem, bounds, weights, conflict);
}

NamedLimit nameOf(const StepProblem& problem, const Conflict::Limit& limit) noexcept {
  const bool row = limit.kind == Conflict::Kind::kRow;
  const Joint joint = place(problem, row ? problem.row[limit.index].second : limit.index);
  NamedLimit name{LimitKind::kNeighbour, joint.arm, joint.tube};
  if (row)
    return name;
  // Limit of the joint: its own velocity, or the remaining distance to its position limit.
  if (std::abs(limit.bound) >= problem.joint[limit.index].velocity * (1.0 - 1e-9))
    name.kind = joint.rotation ? LimitKind::kRotationVelocity : LimitKind::kVelocity;
  else if (limit.step)
    name.kind = joint.rotation ? LimitKind::kRotationStep : LimitKind::kTranslationStep;
  else if (joint.rotation)
    name.kind = LimitKind::kRotation;
  else
    name.kind = limit.kind == Conflict::Kind::kLower ? LimitKind::kRearTravel : LimitKind::kFrontTravel;
  return name;
}

std::string armLetter(int arm) { return std::string(1, static_cast<char>('a' + arm)); }

std::string describe(const NamedLimit& limit, const std::vector<std::string>& arms) {
  const auto arm = static_cast<std::size_t>(limit.arm);
  const std::string whose =
      "tube " + std::to_string(limit.tube) + " of arm " + (arm < arms.size() ? arms[arm] : armLetter(limit.arm));
  if (limit.kind == LimitKind::kNeighbour)
    return whose + " against tube " + std::to_string(limit.tube - 1);
  const std::string_view kind = idl::find(limit.kind) == nullptr ? "unknown limit" : name(limit.kind);
  return std::string(kind) + " of " + whose;
}

std::string describe(const StepProblem& problem, const Conflict& conflict, const std::vector<std::string>& arms) {
  std::string text;
  for (int i = 0; i < conflict.count; ++i)
    text += (i > 0 ? ", " : "") + describe(nameOf(problem, conflict.limit[i]), arms);
  return text;
}

}  // namespace tandem::control
