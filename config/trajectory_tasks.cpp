// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "config/arm_names.h"
#include "config/detail/loaders.h"

namespace tandem::config {
namespace {

/// On the wire a remote centre whose point moves.
constexpr const char* kFollowTheLeader = "follow_the_leader";

/// The further tasks in the order of their table.
constexpr std::pair<const char*, std::optional<TrajectoryFurther> TrajectoryTask::*> kFurther[] = {
    {"axis", &TrajectoryTask::axis},
    {"orientation", &TrajectoryTask::orientation},
    {"relative_orientation", &TrajectoryTask::relative_orientation},
    {"look_at", &TrajectoryTask::look_at},
    {"remote_centre", &TrajectoryTask::remote_centre},
    {kFollowTheLeader, &TrajectoryTask::follow_the_leader},
    {"pose", &TrajectoryTask::pose},
    {"relative_pose", &TrajectoryTask::relative_pose},
    {"joint_limits", &TrajectoryTask::joint_limits},
    {"elastic_stability", &TrajectoryTask::elastic_stability}};

void checkWaypoints(const Map& map, const TrajectoryFurther& from) {
  const bool given = !from.waypoints.empty(), wanted = from.desired == planning::Heading::kWaypoints;
  if (wanted && !given)
    map.fail("waypoints", "found none, expected at least one for `desired: waypoints`");
  if (given && !wanted)
    map.fail("waypoints", "found waypoints without `desired: waypoints`, expected both or none");
  const auto out =
      std::ranges::adjacent_find(from.waypoints, [](const auto& a, const auto& b) { return a.at >= b.at; });
  if (out != from.waypoints.end())
    map.fail("waypoints", "found at: " + formatNumber(out->at) + " and then at: " + formatNumber((out + 1)->at) +
                              ", expected ascending values");
}

planning::FurtherTask furtherOf(const Map& map, const char* name, const TrajectoryFurther& from) {
  const bool follows = std::string_view(name) == kFollowTheLeader;
  const kinematics::TaskKindEntry& kind =
      follows ? *kinematics::findTaskKind(planning::TaskKind::kRemoteCentre) : *kinematics::findTaskKind(name);
  if (kind.hasOrientation())
    checkWaypoints(map.map(name), from);
  planning::FurtherTask task;
  task.kind = kind.kind;
  task.follows_leader = follows;
  task.heading = from.desired;
  task.waypoints = from.waypoints;
  task.target = kind.soft() ? Eigen::Vector3d(from.distance, 0.0, 0.0) : from.target;
  task.tolerance = from.tolerance;
  task.arm_name = from.arms.empty() ? from.arm : from.arms[0];
  task.arm = indexOfLetter(task.arm_name);
  if (task.relative()) {
    task.other_arm_name = from.arms[1];
    task.other_arm = indexOfLetter(task.other_arm_name);
  }
  return task;
}

/// Index of the only task with a key; -1: none. @throw Error at a second one.
int placeOf(const Map& map, const std::vector<Map>& tasks, const std::string& name) {
  int place = -1;
  for (std::size_t k = 0; k < tasks.size(); ++k) {
    if (!tasks[k].has(name))
      continue;
    if (place >= 0)
      map.fail("tasks", "found `" + name + "` twice, expected it once", static_cast<int>(k));
    place = static_cast<int>(k);
  }
  return place;
}

}  // namespace

void readTasks(const Map& map, planning::TrajectorySpec& spec) {
  if (!map.has("tasks"))
    return;
  for (const char* key : {"arm", "other_arm"}) {
    if (map.has(key))
      map.fail(key, "found both tasks and " + std::string(key) + ", which is a short form of it; expected one of them");
  }
  const std::vector<Map> tasks = map.maps("tasks");
  const int tip = placeOf(map, tasks, "tip"), relative = placeOf(map, tasks, "relative");
  placeOf(map, tasks, kFollowTheLeader);
  const auto pose = std::ranges::find_if(tasks, [](const Map& task) { return task.has("pose"); });
  spec.tip_task = tip >= 0;
  if ((!spec.tip_task && pose == tasks.end()) || (spec.tip_task && relative > tip))
    map.fail("tasks",
             "found other tasks, expected one `tip` or a `pose`, at most one `relative` before the tip, and further "
             "tasks, by priority");
  spec.arm_name = spec.tip_task ? tasks[static_cast<std::size_t>(tip)].read<TrajectoryTask>().tip
                                : pose->read<TrajectoryTask>().pose->arm;
  spec.other_arm_name.clear();
  if (relative >= 0) {
    const Map& own = tasks[static_cast<std::size_t>(relative)];
    const auto arms = own.read<TrajectoryTask>().relative;
    if (arms[0] != spec.arm_name)
      own.fail("relative",
               "found another arm first than the one that follows the shape, expected " + spec.arm_name + " first", 0);
    spec.other_arm_name = arms[1];
  } else if (map.has("relative")) {
    map.fail("relative", "found without a task `relative: [a, b]`, expected such a task, or no such key");
  }
  for (std::size_t k = 0; k < tasks.size(); ++k) {
    const auto task = tasks[k].read<TrajectoryTask>();
    for (const auto& [name, member] : kFurther) {
      if (!(task.*member))
        continue;
      spec.further.push_back(furtherOf(tasks[k], name, *(task.*member)));
      spec.further.back().priority = static_cast<int>(k);
      if (spec.further.back().follows_leader && spec.further.back().arm_name != spec.arm_name)
        tasks[k].map(name).fail("arm", "found another arm than the one that follows the shape, expected the same");
    }
  }
}

}  // namespace tandem::config
