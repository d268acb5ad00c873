// SPDX-License-Identifier: Apache-2.0
/** @file Trajectories with further tasks, and arms that follow a tracker exactly. */
#pragma once

#include "arm_pair.h"
#include "control/parameters.h"
#include "dice.h"
#include "planning/reference_tracker.h"
#include "planning/trajectory.h"

namespace tandem::test {

inline constexpr double kStepTime = 0.1;  // s

inline planning::TrajectorySpec lineBy(const Eigen::Vector3d& by, int points) {
  planning::TrajectorySpec spec;
  spec.shape = planning::Line{by};
  spec.point_count = points;
  return spec;
}

inline planning::FurtherTask further(planning::TaskKind kind, int priority) {
  planning::FurtherTask task;
  task.kind = kind;
  task.priority = priority;
  task.arm = 0;
  task.other_arm = kinematics::findTaskKind(kind)->relative() ? 1 : 0;
  return task;
}

inline planning::TrajectoryPoint anyPoint(Dice& dice) {
  planning::TrajectoryPoint start{Eigen::Vector3d(0, 0, 0.3) + dice.ball(0.05), dice.ball(0.02)};
  for (auto& place : start.further)
    place = {start.tip, dice.turn()};
  return start;
}

inline double angleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/** Two arms whose joints follow the tracker exactly. */
struct TaskLoop {
  Pair pair{"rigid"};
  planning::ReferenceTracker tracker;
  planning::TrackResult result;
  safety::RobotVector q;

  explicit TaskLoop(control::Method method, const safety::RobotVector& start)
      : tracker(pair.both.models, pair.both.limits, method, {}, {5.0, 3.0}), q(start) {
    EXPECT_TRUE(tracker.computeTips(q, result));
  }
  planning::TaskReference task(planning::TaskKind kind,
                               const Eigen::Quaterniond& turn = Eigen::Quaterniond::Identity()) const {
    const auto& entry = *kinematics::findTaskKind(kind);
    const kinematics::TaskPlace at = entry.place(result.tip[0].pose, result.tip[1].pose);
    planning::TaskReference task{kind, 0, entry.relative() ? 1 : 0, at.position};
    task.orientation = (turn * at.orientation).normalized();
    return task;
  }
  void go(const planning::Reference& reference, int steps) {
    for (int i = 0; i < steps; ++i) {
      tracker.step(q, q, reference, result);
      ASSERT_EQ(result.status, planning::TrackStatus::kOk);
      q += kStepTime * result.solution.velocity;
    }
    tracker.step(q, q, reference, result);
  }
};

}  // namespace tandem::test
