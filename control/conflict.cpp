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
  const int tubes = (problem.arm_offset[result.arm + 1] - problem.arm_offset[result.arm]) / 2;
  const int within = joint - problem.arm_offset[result.arm];
  result.rotation = within >= tubes;
  result.tube = within % tubes + 1;
  return result;
}

/// What stops a joint: its own velocity, or the way that is left to its limit.
std::string reason(const StepProblem& problem, const Conflict::Limit& limit, const std::vector<std::string>& arms) {
  const bool row = limit.kind == Conflict::Kind::kRow;
  const Joint joint = place(problem, row ? problem.row[limit.index].second : limit.index);
  const std::string whose = "tube " + std::to_string(joint.tube) + " of arm " + arms.at(joint.arm);
  if (row)
    return whose + " against tube " + std::to_string(joint.tube - 1);
  const JointState& state = problem.joint[limit.index];
  const double speed = std::abs(limit.bound);
  if (speed >= state.velocity * (1.0 - 1e-9))
    return (joint.rotation ? "rotation velocity limit of " : "velocity limit of ") + whose;
  if (limit.step)
    return std::string("largest ") + (joint.rotation ? "rotation" : "translation") + " in a step of " + whose;
  if (joint.rotation)
    return "rotation limit of " + whose;
  return (limit.kind == Conflict::Kind::kLower ? "rear travel limit of " : "front travel limit of ") + whose;
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

std::string describe(const StepProblem& problem, const Conflict& conflict, const std::vector<std::string>& arms) {
  std::string text;
  for (int i = 0; i < conflict.count; ++i)
    text += (i > 0 ? ", " : "") + reason(problem, conflict.limit[i], arms);
  return text;
}

}  // namespace tandem::control
