// SPDX-License-Identifier: Apache-2.0
#include "planning/detail/further_tasks.h"

#include <algorithm>

#include "kinematics/rotations.h"
#include "planning/tips.h"

namespace tandem::planning {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using kinematics::rotationBy;
using kinematics::smallestRotation;
using kinematics::TaskPlace;

/// Rotation from the start at a fraction of the path: slerp between the waypoints, constant after the last.
Quaterniond turnAt(const std::vector<HeadingWaypoint>& waypoints, double at) {
  HeadingWaypoint before{0.0, Vector3d::Zero()};
  for (const HeadingWaypoint& waypoint : waypoints) {
    if (at <= waypoint.at) {
      const double piece = waypoint.at - before.at;
      return rotationBy(before.rotation)
          .slerp(piece > 0.0 ? (at - before.at) / piece : 1.0, rotationBy(waypoint.rotation));
    }
    before = waypoint;
  }
  return rotationBy(before.rotation);
}

/// The orientation of the point before, turned so that its z axis points along a step; unchanged by a step of no
/// length.
Quaterniond alongStep(const Quaterniond& orientation, const Vector3d& step) {
  const double length = step.norm();
  if (!(length > 0.0))
    return orientation;
  const Vector3d axis = orientation.toRotationMatrix().col(2);
  return (rotationBy(smallestRotation(axis, step / length)) * orientation).normalized();
}

/// Whether a task has a target instead of an orientation.
bool hasTarget(const FurtherTask& task) {
  return kinematics::findTaskKind(task.kind)->part == kinematics::TaskPart::kPosition;
}

}  // namespace

void setFurther(const TrajectorySpec& spec, const TrajectoryPoint& start, std::vector<TrajectoryPoint>& points) {
  for (std::size_t k = 0; k < spec.further.size(); ++k) {
    const FurtherTask& task = spec.further[k];
    const Quaterniond first = start.further[k].orientation;
    Quaterniond last = first;
    Vector3d tip = start.tip;
    for (std::size_t i = 0; i < points.size(); ++i) {
      TaskPlace& place = points[i].further[k];
      place = start.further[k];
      if (task.kind == TaskKind::kTipPose && task.arm == spec.arm)
        place.position = points[i].tip;
      if (hasTarget(task)) {
        place.position = task.target;
      } else if (task.heading == Heading::kTangent) {
        place.orientation = last = alongStep(last, points[i].tip - tip);
        tip = points[i].tip;
      } else if (task.heading == Heading::kWaypoints) {
        const double at = static_cast<double>(i + 1) / static_cast<double>(points.size());
        place.orientation = (turnAt(task.waypoints, at) * first).normalized();
      }
    }
  }
}

TrajectoryPoint wantedAtStart(const TrajectorySpec& spec, const TrajectoryPoint& measured) {
  TrajectoryPoint wanted = measured;
  for (std::size_t k = 0; k < spec.further.size(); ++k) {
    if (hasTarget(spec.further[k]))
      wanted.further[k].position = spec.further[k].target;
  }
  return wanted;
}

TaskPlace placeOf(const TaskReference& task, const TipFollower& tips, const MeasuredTips* measured) noexcept {
  const kinematics::TaskKindEntry& kind = *kinematics::findTaskKind(task.kind);
  if (kind.soft())
    return {{tips.avoidance(task.arm, kind.point, task.position.x()).cost, 0.0, 0.0}};
  const auto pose = [&](int arm) { return measuredPose(tips.tip(arm).pose, measured, arm); };
  if (kind.point == kinematics::TaskPoint::kTip)
    return kind.place(pose(task.arm), pose(kind.relative() ? task.other_arm : task.arm));
  kinematics::ShaftPoint foot;
  if (tips.shaftPoint(task.arm, task.position, false, foot) != kinematics::ModelStatus::kOk)
    foot.pose.translation().setConstant(std::numeric_limits<double>::quiet_NaN());
  return kind.place(foot.pose, foot.pose);
}

TrajectoryPoint pointAt(const TrajectorySpec& spec, const TipFollower& tips, const MeasuredTips* measured) noexcept {
  TrajectoryPoint point = positionsAt(spec, [&](int arm) { return measuredPose(tips.tip(arm).pose, measured, arm); });
  for (std::size_t k = 0; k < spec.further.size(); ++k) {
    const FurtherTask& task = spec.further[k];
    point.further[k] = placeOf({task.kind, task.arm, task.other_arm, task.target}, tips, measured);
  }
  return point;
}

std::vector<int> TrajectorySpec::arms() const {
  std::vector<int> arms{arm};
  if (hasRelative())
    arms.push_back(other_arm);
  for (const FurtherTask& task : further) {
    arms.push_back(task.arm);
    if (task.relative())
      arms.push_back(task.other_arm);
  }
  return arms;
}

TrajectorySpec TrajectorySpec::ofPositions() const {
  TrajectorySpec spec = *this;
  spec.further.clear();
  spec.tip_task = true;
  return spec;
}

std::string TrajectorySpec::wrongArms(int count) const {
  for (const int k : arms()) {
    if (k < 0 || k >= count)
      return "found arm " + std::to_string(k) + ", expected an index of 0 to " + std::to_string(count - 1);
  }
  bool twice = hasRelative() && arm == other_arm;
  for (const FurtherTask& task : further)
    twice = twice || (task.relative() && task.arm == task.other_arm);
  return twice ? kSameArmTwice : "";
}

std::string TrajectorySpec::wrongModels(const std::vector<const kinematics::ArmModel*>& models) const {
  for (const FurtherTask& task : further) {
    if (task.kind == TaskKind::kElasticStability && !models[static_cast<std::size_t>(task.arm)]->canSnap())
      return "found elastic_stability of an arm whose model cannot lose it, expected concentric tubes with the "
             "compliant model (key model of the deployment, option --model)";
  }
  return {};
}

TrajectoryPoint between(const TrajectorySpec& spec,
                        const TrajectoryPoint& from,
                        const TrajectoryPoint& to,
                        double share) noexcept {
  TrajectoryPoint point{from.tip + share * (to.tip - from.tip), from.relative + share * (to.relative - from.relative)};
  for (std::size_t k = 0; k < spec.further.size(); ++k) {
    const TaskPlace &first = from.further[k], &last = to.further[k];
    point.further[k] = {first.position + share * (last.position - first.position),
                        first.orientation.slerp(share, last.orientation)};
  }
  return point;
}

Reference referenceTo(const TrajectorySpec& spec, const TrajectoryPoint& point) noexcept {
  Reference reference;
  std::size_t next = 0;
  const auto add_further = [&] {
    while (next < spec.further.size() && spec.further[next].priority <= reference.task_count) {
      const FurtherTask& task = spec.further[next];
      const TaskPlace& place = point.further[next++];
      TaskReference& to = reference.tasks[static_cast<std::size_t>(reference.task_count++)];
      to = {task.kind, task.arm, task.other_arm, place.position, Vector3d::Zero(), place.orientation};
    }
  };
  const auto add = [&](const TaskReference& task) {
    add_further();
    reference.tasks[static_cast<std::size_t>(reference.task_count++)] = task;
  };
  if (spec.hasRelative())
    add({TaskKind::kRelativePosition, spec.arm, spec.other_arm, point.relative});
  if (spec.tip_task)
    add({TaskKind::kTipPosition, spec.arm, 0, point.tip});
  add_further();
  return reference;
}

Reference referenceTo(const TrajectorySpec& spec,
                      const TrajectoryPoint& point,
                      const TrajectoryPoint& from,
                      const TrajectoryPoint& to,
                      double time) noexcept {
  Reference reference = referenceTo(spec, point);
  std::size_t next = 0;
  for (int t = 0; t < reference.task_count; ++t) {
    TaskReference& task = reference.tasks[static_cast<std::size_t>(t)];
    if (next < spec.further.size() && spec.further[next].priority == t) {
      const TaskPlace &first = from.further[next], &last = to.further[next];
      task.feed_forward = (last.position - first.position) / time;
      task.angular_feed_forward = kinematics::logarithm(last.orientation * first.orientation.conjugate()) / time;
      ++next;
    } else if (task.kind == TaskKind::kRelativePosition) {
      task.feed_forward = (to.relative - from.relative) / time;
    } else {
      task.feed_forward = (to.tip - from.tip) / time;
    }
  }
  return reference;
}

}  // namespace tandem::planning
