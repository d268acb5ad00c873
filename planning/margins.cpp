// SPDX-License-Identifier: Apache-2.0
#include "planning/margins.h"

namespace tandem::planning {

Margins::Margins(std::vector<const kinematics::ArmModel*> models, const control::MethodParameters& parameters)
    : models_(std::move(models)),
      gain_(parameters.barrier_gain),
      least_stability_(parameters.least_stability),
      least_distance_(parameters.least_distance) {}

/// A new margin whose gradient is still zero.
void Margins::add(double value, double least, control::StepProblem& problem) const {
  control::Barrier& barrier = problem.barrier[static_cast<std::size_t>(problem.barrier_count++)];
  barrier.gradient.setZero(problem.joint_count);
  barrier.rate = -gain_ * (value - least);
}

void Margins::addDistance(const TipFollower& tips,
                          const safety::RobotVector& q,
                          int a,
                          int b,
                          control::StepProblem& problem) {
  const auto body = [&](int k, kinematics::Body& result) {
    const int begin = problem.arm_offset[static_cast<std::size_t>(k)];
    const int size = problem.arm_offset[static_cast<std::size_t>(k) + 1] - begin;
    kinematics::Branch branch = tips.branch(k);
    return kinematics::makeBody(*models_[static_cast<std::size_t>(k)], q.segment(begin, size), branch, true, result) ==
           kinematics::ModelStatus::kOk;
  };
  if (!body(a, body_a_) || !body(b, body_b_))
    return;
  const kinematics::Clearance clearance = kinematics::clearance(body_a_, body_b_);
  add(clearance.distance, least_distance_, problem);
  safety::RobotVector& gradient = problem.barrier[static_cast<std::size_t>(problem.barrier_count - 1)].gradient;
  gradient.segment(problem.arm_offset[static_cast<std::size_t>(a)], clearance.by_a.size()) = clearance.by_a.transpose();
  gradient.segment(problem.arm_offset[static_cast<std::size_t>(b)], clearance.by_b.size()) = clearance.by_b.transpose();
}

void Margins::set(const TipFollower& tips,
                  const safety::RobotVector& q,
                  const Reference& reference,
                  control::StepProblem& problem) {
  problem.barrier_count = 0;
  for (int k = 0; least_stability_ > 0.0 && k < problem.arm_count; ++k) {
    const int begin = problem.arm_offset[static_cast<std::size_t>(k)];
    const int size = problem.arm_offset[static_cast<std::size_t>(k) + 1] - begin;
    const kinematics::Gradient gradient =
        models_[static_cast<std::size_t>(k)]->stabilityGradient(q.segment(begin, size), tips.branch(k));
    if (gradient.size() != size || gradient.isZero(0.0))
      continue;
    add(tips.tip(k).stability, least_stability_, problem);
    problem.barrier[static_cast<std::size_t>(problem.barrier_count - 1)].gradient.segment(begin, size) =
        gradient.transpose();
  }
  for (int t = 0; least_distance_ > 0.0 && t < reference.task_count; ++t) {
    const TaskReference& task = reference.tasks[static_cast<std::size_t>(t)];
    if (task.kind == TaskKind::kRelativePosition)
      addDistance(tips, q, task.arm, task.other_arm, problem);
  }
}

}  // namespace tandem::planning
