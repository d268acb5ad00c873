// SPDX-License-Identifier: Apache-2.0
#include "planning/margins.h"

#include <algorithm>
#include <limits>

namespace tandem::planning {
namespace {

constexpr double kUnknown = -std::numeric_limits<double>::infinity();
/// Reserve r after a shortened step, as a fraction of the least value: the first and the largest one, and its factor
/// per period.
constexpr double kFirstReserve = 0.01, kMostReserve = 0.1, kFading = 0.98;

/// Whether a task compares two arms.
bool isPair(const TaskReference& task) {
  const kinematics::TaskKindEntry* kind = kinematics::findTaskKind(task.kind);
  return kind != nullptr && kind->relative();
}

auto jointsOf(const safety::RobotVector& q, int arm, const control::StepProblem& problem) {
  const int begin = problem.arm_offset[static_cast<std::size_t>(arm)];
  return q.segment(begin, problem.arm_offset[static_cast<std::size_t>(arm) + 1] - begin);
}

}  // namespace

Margins::Margins(std::vector<const kinematics::ArmModel*> models, const control::MethodParameters& parameters)
    : models_(std::move(models)),
      period_(parameters.period),
      gain_(parameters.barrier_gain),
      least_stability_(parameters.least_stability),
      least_distance_(parameters.least_distance) {
  kinematics::BodyBuilder::reserve(body_a_);
  kinematics::BodyBuilder::reserve(body_b_);
}

/// Adds a margin with zero gradient.
void Margins::add(const Margin& margin, control::StepProblem& problem) {
  const auto i = static_cast<std::size_t>(problem.barrier_count++);
  margins_[i] = margin;
  double& reserve = reserve_[static_cast<std::size_t>(margin.id)];
  reserve *= kFading;
  problem.barrier[i].gradient.setZero(problem.joint_count);
  problem.barrier[i].rate = -gain_ * (margin.now - margin.least - reserve);
}

bool Margins::makeBodies(const TipFollower& tips,
                         const safety::RobotVector& q,
                         int a,
                         int b,
                         bool derivatives,
                         const control::StepProblem& problem) {
  const auto body = [&](int k, kinematics::Body& result) {
    kinematics::Branch branch = tips.branch(k);
    return bodies_.make(*models_[static_cast<std::size_t>(k)], jointsOf(q, k, problem), branch, derivatives, result) ==
           kinematics::ModelStatus::kOk;
  };
  return body(a, body_a_) && body(b, body_b_);
}

void Margins::addDistance(const TipFollower& tips,
                          const safety::RobotVector& q,
                          int a,
                          int b,
                          int id,
                          control::StepProblem& problem) {
  if (!makeBodies(tips, q, a, b, true, problem))
    return;
  const kinematics::Clearance clearance = kinematics::clearance(body_a_, body_b_);
  add({a, b, least_distance_, clearance.distance, id}, problem);
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
    const auto joints = jointsOf(q, k, problem);
    const kinematics::Gradient gradient =
        models_[static_cast<std::size_t>(k)]->stabilityGradient(joints, tips.branch(k));
    if (gradient.size() != joints.size() || gradient.isZero(0.0))
      continue;
    add({k, -1, least_stability_, tips.tip(k).stability, k}, problem);
    problem.barrier[static_cast<std::size_t>(problem.barrier_count - 1)].gradient.segment(
        problem.arm_offset[static_cast<std::size_t>(k)], joints.size()) = gradient.transpose();
  }
  for (int t = 0; least_distance_ > 0.0 && t < reference.task_count; ++t) {
    const TaskReference& task = reference.tasks[static_cast<std::size_t>(t)];
    if (isPair(task) && std::none_of(reference.tasks.begin(), reference.tasks.begin() + t, [&](const auto& before) {
          return isPair(before) && std::minmax(before.arm, before.other_arm) == std::minmax(task.arm, task.other_arm);
        }))
      addDistance(tips, q, task.arm, task.other_arm, safety::kMaxArms + t, problem);
  }
}

/// A margin at other joints, near those of `tips`; minus infinity if the model has no solution.
double Margins::at(const Margin& margin,
                   const TipFollower& tips,
                   const safety::RobotVector& q,
                   const control::StepProblem& problem) {
  if (margin.other >= 0)
    return makeBodies(tips, q, margin.arm, margin.other, false, problem)
               ? kinematics::clearance(body_a_, body_b_).distance
               : kUnknown;
  kinematics::Branch branch = tips.branch(margin.arm);
  const kinematics::ModelStatus status =
      models_[static_cast<std::size_t>(margin.arm)]->tip(jointsOf(q, margin.arm, problem), branch, tip_);
  return status == kinematics::ModelStatus::kOk && !branch.snapped ? tip_.stability : kUnknown;
}

void Margins::keep(const TipFollower& tips,
                   const safety::RobotVector& q,
                   const control::StepProblem& problem,
                   control::Solution& solution) {
  constexpr int kHalvings = 10;
  double share = 1.0;
  for (int i = 0, halvings = 0; i < problem.barrier_count && share > 0.0;) {
    const Margin& margin = margins_[static_cast<std::size_t>(i)];
    const safety::RobotVector next = q + period_ * share * solution.velocity;
    if (at(margin, tips, next, problem) >= std::min(margin.least, margin.now)) {
      ++i;
      continue;
    }
    double& reserve = reserve_[static_cast<std::size_t>(margin.id)];
    reserve = std::clamp(2.0 * reserve, kFirstReserve * margin.least, kMostReserve * margin.least);
    share = ++halvings > kHalvings ? 0.0 : 0.5 * share;
    i = 0;  // a margin satisfied by the longer step may be violated by the shorter one
  }
  if (share == 1.0)
    return;
  solution.velocity *= share;
  for (double& scale : solution.scale)
    scale *= share;
}

}  // namespace tandem::planning
