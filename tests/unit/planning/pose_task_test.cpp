// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "task_loop.h"

namespace tandem::test {
namespace {

using control::Method;
using kinematics::findTaskKind;
using planning::Heading;
using planning::TaskKind;
using planning::TrajectoryPoint;

/// A pose takes the place of the tip: its position follows the shape; that of another arm is kept.
TEST(PoseTask, APoseFollowsTheShape) {
  Dice dice(1);
  auto spec = lineBy({0, 0, 0.01}, 4);
  spec.other_arm = planning::kNoArm;
  spec.tip_task = false;
  spec.further = {further(TaskKind::kRelativePose, 0), further(TaskKind::kTipPose, 1), further(TaskKind::kTipPose, 2)};
  spec.further[1].heading = Heading::kTangent;
  spec.further[2].arm = 1;
  const TrajectoryPoint start = anyPoint(dice);
  const auto points = planning::sample(spec, start);
  const planning::Reference reference = planning::referenceTo(spec, points[2], points[1], points[2], 2.0);
  ASSERT_EQ(reference.task_count, 3);
  EXPECT_EQ(reference.task_count, spec.taskCount());
  EXPECT_EQ(reference.tasks[1].kind, TaskKind::kTipPose);
  EXPECT_EQ(reference.tasks[1].position, points[2].tip);
  EXPECT_LT((reference.tasks[1].feed_forward - (points[2].tip - points[1].tip) / 2.0).norm(), 1e-12);
  EXPECT_LT(angleBetween(reference.tasks[1].orientation.toRotationMatrix().col(2), Eigen::Vector3d::UnitZ()), 1e-7);
  for (const int t : {0, 2}) {
    const auto& place = start.further[static_cast<std::size_t>(t)];
    EXPECT_EQ(reference.tasks[static_cast<std::size_t>(t)].position, place.position);
    EXPECT_EQ(reference.tasks[static_cast<std::size_t>(t)].orientation.coeffs(), place.orientation.coeffs());
  }
  EXPECT_EQ(spec.ofPositions().taskCount(), 1) << "the position of the tip is what is left";
}

/// Attainable poses: position and orientation of a tip, and of one tip relative to another, both vanish.
TEST(PoseTask, EveryMethodThatKeepsTheOrderReachesAnAttainablePose) {
  for (const Method method : {Method::kNspwlnJoint, Method::kNspqp, Method::kSnsqp, Method::kSns, Method::kHqp}) {
    for (const TaskKind kind : {TaskKind::kTipPose, TaskKind::kRelativePose}) {
      SCOPED_TRACE(std::string(control::name(method)) + " " + std::string(findTaskKind(kind)->name));
      safety::RobotVector start(12), there(12);
      start << arkStart(1, 0), arkStart(1, 1);
      there = start;
      for (int j = 0; j < 12; ++j)
        there[j] += j % 6 < 3 ? 1e-3 * (j % 3 - 1) : (j < 6 ? 0.06 : -0.04) * (1 + j % 2);
      TaskLoop goal(method, there), loop(method, start);
      planning::Reference reference;
      reference.task_count = 2;
      reference.tasks[0] = goal.task(kind);
      reference.tasks[1] = goal.task(TaskKind::kTipPosition);
      if (kind == TaskKind::kTipPose) {
        reference.tasks[1].arm = 1;
        reference.tasks[1].position = goal.result.tip[1].pose.translation();
      }
      loop.go(reference, 1);
      const double first = loop.result.error[0];
      ASSERT_GT(first, 1e-3) << "m, radians times length";
      loop.go(reference, 200);
      EXPECT_LT(loop.result.error[0], 0.02 * first);
      EXPECT_LT(loop.result.error[1], 1e-4);
    }
  }
}

}  // namespace
}  // namespace tandem::test
