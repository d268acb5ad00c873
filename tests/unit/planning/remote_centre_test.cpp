// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "planning/task_freedom.h"
#include "task_loop.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::test {
namespace {

using control::Method;
using planning::TaskKind;

constexpr double kHeld = 0.05e-3;  // m
/// Methods that keep the order of all tasks.
constexpr std::array kOrdered{Method::kNspqp, Method::kSns, Method::kHqp, Method::kSnsqp, Method::kNspwlnJoint};

/** One arm whose joints follow the tracker exactly. */
struct CentreLoop {
  const planning::Arms& arms;
  planning::ReferenceTracker tracker;
  planning::TrackResult result;
  safety::RobotVector q;
  planning::Reference reference;

  double period;

  CentreLoop(const planning::Arms& of, Method method, const safety::RobotVector& start, double step = kStepTime)
      : arms(of), tracker(of.models, of.limits, method, {.period = step}, {5.0, 3.0}), q(start), period(step) {
    EXPECT_TRUE(tracker.computeTips(q, result));
  }
  Eigen::Vector3d tip(std::size_t arm = 0) const { return result.tip[arm].pose.translation(); }
  /// Point of the shaft at a fraction of its length.
  Eigen::Vector3d onShaft(double share) const {
    std::vector<kinematics::ShapePoint> shape;
    EXPECT_EQ(arms.models[0]->shape(q.head(arms.size(0)), 101, shape), kinematics::ModelStatus::kOk);
    return shape[static_cast<std::size_t>(100 * share)].pose.translation();
  }
  /// Of the shaft from a point, m, by many points of it.
  double distanceTo(const Eigen::Vector3d& point) const {
    kinematics::ShaftPoint foot;
    EXPECT_EQ(tracker.tips().shaftPoint(0, point, false, foot), kinematics::ModelStatus::kOk);
    return (point - foot.pose.translation()).norm();
  }
  bool step() {
    tracker.step(q, q, reference, result);
    if (result.status != planning::TrackStatus::kOk)
      return false;
    q += period * result.solution.velocity;
    return tracker.computeTips(q, result);
  }
};

safety::RobotVector jointsOf(const Pair& pair, Random& random) {
  safety::RobotVector q;
  std::vector<kinematics::Tip> tips;
  while (!pair.known(pair.one, random, q, tips) || q[0] < -0.35 || q[0] > -0.02) {
  }
  return q;
}

/// Whether ends and bends of tubes are farther than `apart` from each other and from the entry point: where they cross
/// the rigid Jacobian jumps.
bool smoothWithin(const safety::RobotVector& q, double apart) {
  const kinematics::ConcentricTubeArm arm = arkArm(0.0);
  std::vector<double> places{0.0};
  for (int i = 0; i < 3; ++i) {
    const double length = arm.tubes[static_cast<std::size_t>(i)].length();
    places.insert(places.end(), {q[i] + length, q[i] + length - 0.05});
  }
  std::sort(places.begin(), places.end());
  return std::adjacent_find(places.begin(), places.end(), [&](double a, double b) { return b - a < apart; }) ==
         places.end();
}

/// 10,000 motions of the tip at 50 Hz with the centre first: the shaft stays at it. Where the rigid Jacobian jumps, a
/// step is wrong by its length times the jump: docs/tasks.md has the numbers.
TEST(RemoteCentre, IsHeldOver10000Motions) {
  constexpr int kMotions = 10000, kSteps = 10;
  constexpr double kPeriod = 0.02, kSpeed = 5e-3, kTurn = 0.5;  // s, m/s, rad/s: ark2024, rotations as those of snsqp
  Pair pair("rigid");
  for (safety::JointLimit& joint : pair.limits.joints)
    joint.velocity = joint.kind == safety::JointKind::kRotation ? kTurn : kSpeed;
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  double worst = 0.0, way = 0.0;
  int moved = 0;
  for (int i = 0; i < kMotions; ++i) {
    const Method method = kOrdered[static_cast<std::size_t>(i) % 3];
    safety::RobotVector joints = jointsOf(pair, random);
    while (!smoothWithin(joints, 2.1 * kSteps * kPeriod * kSpeed))
      joints = jointsOf(pair, random);
    CentreLoop loop(pair.one, method, joints, kPeriod);
    const Eigen::Vector3d centre = loop.onShaft(random.uniform(0.2, 0.9)), start = loop.tip();
    loop.reference.task_count = 2;
    loop.reference.tasks[0] = {TaskKind::kRemoteCentre, 0, 0, centre};
    loop.reference.tasks[1] = {TaskKind::kTipPosition, 0, 0, start + anyVector(random, 2e-3)};
    double off = 0.0;
    for (int step = 0; step < kSteps && loop.step(); ++step)
      off = std::max(off, loop.distanceTo(centre));
    worst = std::max(worst, off);
    EXPECT_LT(off, kHeld) << "motion " << i << ", " << control::name(method) << ", start " << loop.q.transpose();
    way += (loop.tip() - start).norm() / kMotions;
    moved += (loop.tip() - start).norm() > 0.1e-3 ? 1 : 0;
  }
  RecordProperty("worst_mm", std::to_string(1e3 * worst));
  RecordProperty("mean_way_mm", std::to_string(1e3 * way));
  EXPECT_GT(moved, kMotions / 2) << "the tip moves meanwhile";
}

/// With a compliant arm, and as the last of three tasks of two arms in every method that keeps the order of tasks.
TEST(RemoteCentre, IsReachedAtEveryPriority) {
  for (const char* model : {"rigid", "compliant"}) {
    const Pair pair(model);
    for (const Method method : kOrdered) {
      for (int priority = 0; priority < 3; ++priority) {
        SCOPED_TRACE(std::string(model) + " " + std::string(control::name(method)) + " " + std::to_string(priority));
        safety::RobotVector start(12);
        start << arkStart(1, 0), arkStart(1, 1);
        CentreLoop loop(pair.both, method, start);
        std::vector<planning::TaskReference> tasks{{TaskKind::kRelativePosition, 0, 1, loop.tip(0) - loop.tip(1)},
                                                   {TaskKind::kTipPosition, 0, 0, loop.tip(0)}};
        const Eigen::Vector3d centre = loop.onShaft(0.5) + Eigen::Vector3d(4e-4, -3e-4, 0.0);
        tasks.insert(tasks.begin() + priority, {TaskKind::kRemoteCentre, 0, 0, centre});
        loop.reference.task_count = 3;
        std::copy(tasks.begin(), tasks.end(), loop.reference.tasks.begin());
        const double first = loop.distanceTo(centre);
        ASSERT_GT(first, 2e-4);
        for (int i = 0; i < 60; ++i)
          ASSERT_TRUE(loop.step());
        EXPECT_LT(loop.distanceTo(centre), 0.1 * first);
        EXPECT_LT((loop.tip(0) - tasks[priority == 2 ? 1 : 2].position).norm(), 1e-4);
      }
    }
  }
}

TEST(RemoteCentre, HasTheRankTwoOnTheShaftAndNoneBehindTheEntryPoint) {
  const Pair pair("rigid");
  safety::RobotVector q(12);
  q << arkStart(1, 0), arkStart(1, 1);
  const CentreLoop loop(pair.both, Method::kNspqp, q);
  planning::TrajectorySpec spec;
  spec.shape = planning::Line{{0, 0, 0.01}};
  planning::FurtherTask centre;
  centre.kind = TaskKind::kRemoteCentre;
  centre.priority = 0;
  centre.target = loop.onShaft(0.6);
  spec.further = {centre};
  const auto freedom = planning::taskFreedom(pair.both, spec, q);
  ASSERT_EQ(freedom.size(), 3u);
  EXPECT_EQ(freedom[0].rank, 2);
  EXPECT_EQ(planning::lostTask(freedom, {"a", "b"}), "");
  spec.further[0].target = Eigen::Vector3d(0.0, 0.005, -0.01);
  EXPECT_EQ(planning::lostTask(planning::taskFreedom(pair.both, spec, q), {"a", "b"}),
            "remote centre of a: at the start the joints do not move it");
}

TEST(RemoteCentre, StepAllocatesNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  for (const char* model : {"rigid", "compliant"}) {
    const Pair pair(model);
    CentreLoop loop(pair.one, Method::kHqp, arkStart(1, 0));
    loop.reference.task_count = 2;
    loop.reference.tasks[0] = {TaskKind::kRemoteCentre, 0, 0, loop.onShaft(0.5)};
    loop.reference.tasks[1] = {TaskKind::kTipPosition, 0, 0, loop.tip() + Eigen::Vector3d(1e-3, 0, 0)};
    loop.step();
    const std::size_t before = allocationCount();
    for (int i = 0; i < 10; ++i)
      loop.step();
    EXPECT_EQ(allocationCount(), before) << model;
  }
}

}  // namespace
}  // namespace tandem::test
