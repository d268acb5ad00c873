// SPDX-License-Identifier: Apache-2.0
#include "planning/task_freedom.h"

#include <Eigen/SVD>
#include <algorithm>

#include "planning/detail/further_tasks.h"
#include "planning/reference_tracker.h"

namespace tandem::planning {
namespace {

/// The tasks at the place where the tips are; that of a shaft which follows its leader in the middle of the shaft.
Reference presentTasks(TrajectorySpec spec, const TipFollower& tips) {
  std::vector<kinematics::BackbonePoint> shaft;
  for (FurtherTask& task : spec.further) {
    if (task.follows_leader && tips.shaft(task.arm, 3, shaft) == kinematics::ModelStatus::kOk)
      task.target = shaft[1].position;
  }
  const TrajectoryPoint here = pointAt(spec, tips, nullptr);
  return referenceTo(spec, wantedAtStart(spec, here));
}

/// Jacobian of a task with all joints in m.
Eigen::MatrixXd scaled(const control::StepProblem& problem, int task) {
  Eigen::MatrixXd jacobian = problem.task[static_cast<std::size_t>(task)].jacobian;
  for (int j = 0; j < problem.joint_count; ++j) {
    if (problem.joint[static_cast<std::size_t>(j)].kind == safety::JointKind::kRotation)
      jacobian.col(j) /= kinematics::kLengthPerRadian;
  }
  return jacobian;
}

void note(const control::StepProblem& problem, const Reference& reference, int point, std::vector<TaskFreedom>& all) {
  const bool first = all.empty();
  all.resize(static_cast<std::size_t>(reference.task_count));
  Eigen::MatrixXd free = Eigen::MatrixXd::Identity(problem.joint_count, problem.joint_count);
  for (int t = 0; t < reference.task_count; ++t) {
    TaskFreedom& freedom = all[static_cast<std::size_t>(t)];
    const Eigen::MatrixXd left = scaled(problem, t) * free;
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(left, Eigen::ComputeThinU | Eigen::ComputeThinV);
    const auto rank = (svd.singularValues().array() > kLostDirection).count();
    const double least = left.rows() <= left.cols() ? svd.singularValues().minCoeff() : 0.0;
    if (first || rank < freedom.rank) {
      freedom.rank = static_cast<int>(rank);
      freedom.rank_point = point;
    }
    if (first || least < freedom.least) {
      freedom.least = least;
      freedom.least_point = point;
    }
    freedom.task = reference.tasks[static_cast<std::size_t>(t)];
    freedom.rows = static_cast<int>(left.rows());
    if (problem.task[static_cast<std::size_t>(t)].activation < 1.0)
      continue;
    const Eigen::MatrixXd taken = svd.matrixV().leftCols(rank);
    free -= taken * taken.transpose();
  }
}

/// Distances of the soft tasks from what they keep away from.
void noteDistances(const TipFollower& tips, int point, std::vector<TaskFreedom>& all) {
  for (TaskFreedom& one : all) {
    if (!one.soft())
      continue;
    const double distance = one.task.position.x();
    const auto avoidance = tips.avoidance(one.task.arm, kinematics::findTaskKind(one.task.kind)->point, distance);
    if (avoidance.least < one.nearest) {
      one.nearest = avoidance.least;
      one.nearest_point = point;
    }
    one.near_points += avoidance.least < distance ? 1 : 0;
  }
}

}  // namespace

std::vector<TaskFreedom> taskFreedom(const Arms& arms, const TrajectorySpec& spec, const Eigen::MatrixXd& path) {
  std::vector<TaskFreedom> all;
  ReferenceTracker tracker(arms.models, arms.limits, control::Method::kNspqp, {}, {});
  TrackResult result;
  for (Eigen::Index k = 0; k < path.cols(); ++k) {
    const safety::RobotVector q = path.col(k);
    if (!tracker.computeTips(q, result))
      continue;
    const Reference reference = presentTasks(spec, tracker.tips());
    tracker.step(q, q, reference, result);
    if (tracker.problem().task_count == reference.task_count) {
      note(tracker.problem(), reference, static_cast<int>(k), all);
      noteDistances(tracker.tips(), static_cast<int>(k), all);
    }
  }
  for (const FurtherTask& task : spec.further) {
    if (const auto t = static_cast<std::size_t>(task.priority); t < all.size())
      all[t].follows_leader = task.follows_leader;
  }
  return all;
}

std::string lostTask(const std::vector<TaskFreedom>& freedom, const std::vector<std::string>& arms) {
  for (std::size_t k = 0; k < freedom.size(); ++k) {
    if (!freedom[k].lost())
      continue;
    std::string before;
    for (std::size_t i = 0; i < k; ++i)
      before += (i > 0 ? ", " : "") + describe(freedom[i].task, arms);
    const std::string where =
        freedom[k].rank_point > 0 ? "point " + std::to_string(freedom[k].rank_point) : "the start";
    return describe(freedom[k].task, arms) + ": at " + where +
           (before.empty() ? " the joints do not move it"
                           : " the tasks before it (" + before + ") take all degrees of freedom that move it");
  }
  return {};
}

}  // namespace tandem::planning
