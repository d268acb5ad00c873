// SPDX-License-Identifier: Apache-2.0
/** @file Reference tracker for arms that move a common object. */
#include <algorithm>
#include <cmath>

#include "planning/object_path.h"
#include "planning/path_reference.h"
#include "planning/reference_tracker.h"

namespace tandem::planning {

/// @param away  joints minus those of the equilibrium
void ReferenceTracker::addEquilibriumTask(const EquilibriumTask& from, const safety::RobotVector& away) noexcept {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  control::Task& task = problem_.task[static_cast<std::size_t>(problem_.task_count++)];
  task.jacobian = Eigen::Map<const Rows>(from.jacobian.data(), from.rows, problem_.joint_count);
  task.velocity = Eigen::Map<const Eigen::VectorXd>(from.velocity.data(), from.rows);
  task.velocity.noalias() -= task.jacobian * away;
  task.velocity *= gains_.relative;
}

/// @return error of the tracked components, m
double ReferenceTracker::addObjectTask(const Equilibrium& equilibrium,
                                       const safety::RobotVector& away,
                                       const ObjectReference& reference) noexcept {
  const Twist moved = equilibrium.motion() * away;
  const Eigen::Isometry3d pose = displaced(equilibrium.pose(), moved);
  const Twist error = difference(pose, poseOf(reference));
  const Twist velocity = reference.feed_forward + gains_.tip * error;
  control::Task& task = problem_.task[static_cast<std::size_t>(problem_.task_count++)];
  int rows = 0;
  for (const bool tracked : reference.tracked)
    rows += tracked ? 1 : 0;
  task.jacobian.resize(rows, problem_.joint_count);
  task.velocity.resize(rows);
  double squares = 0.0;
  for (int k = 0, row = 0; k < 6; ++k) {
    if (!reference.tracked[static_cast<std::size_t>(k)])
      continue;
    const double unit = k < 3 ? 1.0 : equilibrium.length;  // metres all of them
    task.jacobian.row(row) = unit * equilibrium.motion().row(k);
    task.velocity[row++] = unit * velocity[k];
    squares += unit * error[k] * unit * error[k];
  }
  return std::sqrt(squares);
}

safety::RobotVector ReferenceTracker::moved(const safety::RobotVector& q,
                                            const safety::RobotVector& by) const noexcept {
  safety::RobotVector to = q + by;
  for (int j = 0; j < problem_.joint_count; ++j) {
    const control::JointState& joint = problem_.joint[static_cast<std::size_t>(j)];
    to[j] = std::clamp(to[j], joint.lower, joint.upper);
  }
  return to;
}

void ReferenceTracker::step(const Equilibrium& equilibrium,
                            const safety::RobotVector& q,
                            const safety::RobotVector& setpoint,
                            const ObjectReference& reference,
                            TrackResult& result) noexcept {
  clear(result);
  problem_.task_count = 0;
  if (equilibrium.joint_count != problem_.joint_count || q.size() != equilibrium.joint_count ||
      setpoint.size() != q.size()) {
    result.status = TrackStatus::kNoEquilibrium;
    return;
  }
  constexpr double kRounding = 1e-6;
  bool any = false;
  bool known = reference.position.allFinite() && std::abs(reference.orientation.norm() - 1.0) < kRounding;
  for (int k = 0; k < 6; ++k) {
    any = any || reference.tracked[static_cast<std::size_t>(k)];
    known = known && std::isfinite(reference.feed_forward[k]);
  }
  if (!known || !any) {
    result.status = TrackStatus::kReference;
    return;
  }
  problem_.setPosition(setpoint);
  const safety::RobotVector away = q - equilibrium.q();
  for (int k = 0; k < equilibrium.higher_count; ++k)
    addEquilibriumTask(equilibrium.tasks[static_cast<std::size_t>(k)], away);
  result.first_task = problem_.task_count;
  result.error[0] = addObjectTask(equilibrium, away, reference);
  for (int k = equilibrium.higher_count; k < equilibrium.higher_count + equilibrium.lower_count; ++k)
    addEquilibriumTask(equilibrium.tasks[static_cast<std::size_t>(k)], away);
  problem_.posture = posture_;
  solve(result);
}

}  // namespace tandem::planning
