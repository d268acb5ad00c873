// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "kinematics/rotations.h"
#include "planning/follower.h"
#include "planning/task_freedom.h"
#include "task_loop.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::test {
namespace {

using control::Method;
using kinematics::findTaskKind;
using planning::FurtherTask;
using planning::Heading;
using planning::Phase;
using planning::TaskKind;
using planning::TrajectoryPoint;

/// The methods of the paper, and hqp.
constexpr std::array kMethods{Method::kNspwln, Method::kNspwlnJoint, Method::kNspqp,
                              Method::kSnsqp,  Method::kSns,         Method::kHqp};

TEST(FurtherTasks, HeadingsAreWhatTheirNamesSay) {
  overSeeds([](Dice& dice) {
    const TrajectoryPoint start = anyPoint(dice);
    auto spec = lineBy(Eigen::Vector3d(0, 0, 0.02) + dice.ball(0.01), 10);
    spec.further = {further(TaskKind::kTipAxis, 0), further(TaskKind::kTipOrientation, 1)};
    spec.further[0].heading = Heading::kTangent;
    spec.further[1].heading = Heading::kWaypoints;
    const Eigen::Vector3d first = dice.ball(1.0), second = dice.ball(1.0);
    spec.further[1].waypoints = {{0.3, first}, {0.8, second}};
    const auto points = planning::sample(spec, start);
    const Eigen::Vector3d tangent = (points[1].tip - points[0].tip).normalized();
    for (const TrajectoryPoint& point : points) {
      EXPECT_LT(angleBetween(point.further[0].orientation.toRotationMatrix().col(2), tangent), 1e-7);
    }
    const auto turn_of = [&](int point) {
      const auto turn =
          points[static_cast<std::size_t>(point - 1)].further[1].orientation * start.further[1].orientation.conjugate();
      return Eigen::Quaterniond(turn);
    };
    const Eigen::Quaterniond half = kinematics::rotationBy(first), last = kinematics::rotationBy(second);
    EXPECT_LT(turn_of(3).angularDistance(half), 1e-7);
    EXPECT_LT(turn_of(1).angularDistance(kinematics::rotationBy(first / 3.0)), 1e-7) << "slerp from the start";
    EXPECT_LT(turn_of(6).angularDistance(half.slerp(0.6, last)), 1e-7);
    EXPECT_LT(turn_of(8).angularDistance(last), 1e-7);
    EXPECT_LT(turn_of(10).angularDistance(last), 1e-7) << "kept after the last";
    spec.further[0].heading = Heading::kStart;
    EXPECT_LT(planning::sample(spec, start)[7].further[0].orientation.angularDistance(start.further[0].orientation),
              1e-12);
  });
}

TEST(FurtherTasks, StandAtTheirPriorities) {
  Dice dice(1);
  auto spec = lineBy({0, 0, 0.01}, 4);
  spec.further = {further(TaskKind::kLookAt, 0), further(TaskKind::kTipAxis, 2)};
  spec.further[0].target = {0.1, 0.2, 0.3};
  const auto points = planning::sample(spec, anyPoint(dice));
  const planning::Reference reference = planning::referenceTo(spec, points[2]);
  ASSERT_EQ(reference.task_count, 4);
  const std::array kinds{TaskKind::kLookAt, TaskKind::kRelativePosition, TaskKind::kTipAxis, TaskKind::kTipPosition};
  for (std::size_t t = 0; t < 4; ++t)
    EXPECT_EQ(reference.tasks[t].kind, kinds[t]) << t;
  EXPECT_EQ(reference.tasks[0].position, spec.further[0].target);
  spec.other_arm = planning::kNoArm;
  spec.further[0].priority = 1;
  const planning::Reference alone = planning::referenceTo(spec, points[2]);
  ASSERT_EQ(alone.task_count, 3);
  EXPECT_EQ(alone.tasks[0].kind, TaskKind::kTipPosition);
  EXPECT_EQ(alone.tasks[1].kind, TaskKind::kLookAt);
}

/// A reference that moves with its feed-forward for one period arrives at the next reference of the timed follower.
TEST(FurtherTasks, FeedForwardOfTimedRunsIsTheMotionOfTheReference) {
  overSeeds([](Dice& dice) {
    const TrajectoryPoint start = anyPoint(dice);
    auto spec = lineBy(Eigen::Vector3d(0, 0, 0.02) + dice.ball(0.01), 10);
    spec.following = planning::Following::kTimed;
    spec.further = {further(TaskKind::kTipOrientation, 2)};
    spec.further[0].heading = Heading::kWaypoints;
    spec.further[0].waypoints = {{0.5, dice.ball(1.5)}, {1.0, dice.ball(1.5)}};
    planning::Follower follower(kStepTime);
    follower.start(spec, start);
    planning::Reference reference;
    TrajectoryPoint at = start;
    Eigen::Quaterniond expected = start.further[0].orientation;
    while (follower.update(at, reference)) {
      const planning::TaskReference& task = reference.tasks[2];
      EXPECT_LT(task.orientation.angularDistance(expected), 1e-6);
      expected = kinematics::rotationBy(kStepTime * task.angular_feed_forward) * task.orientation;
      at.tip = reference.tasks[1].position;  // perfect arms
      at.further[0].orientation = task.orientation;
    }
    EXPECT_EQ(follower.progress().phase, Phase::kFinished);
    ASSERT_EQ(follower.errors().size(), 3u);
    EXPECT_LT(follower.errors()[2].maximum(), 1e-6);
  });
}

TEST(FurtherTasks, DecideAboutAPointOnlyWithATolerance) {
  for (const bool strict : {false, true}) {
    Dice dice(7);
    const TrajectoryPoint start = anyPoint(dice);
    auto spec = lineBy({0, 0, 0.01}, 5);
    spec.max_iterations = 3;
    spec.further = {further(TaskKind::kTipAxis, 2)};
    spec.further[0].heading = Heading::kWaypoints;
    spec.further[0].waypoints = {{1.0, {0.5, 0, 0}}};
    if (strict)
      spec.further[0].tolerance = 0.01;
    planning::Follower follower(kStepTime);
    follower.start(spec, start);
    planning::Reference reference;
    TrajectoryPoint at = start;  // the tip follows, its orientation does not
    while (follower.update(at, reference))
      at.tip = reference.tasks[1].position;
    EXPECT_EQ(follower.progress().phase, strict ? Phase::kFailed : Phase::kFinished);
    EXPECT_EQ(follower.progress().missed_points, strict ? 5 : 0);
    EXPECT_GT(follower.errors()[2].maximum(), 0.05) << "the error is reported in any case";
    const std::string misses = planning::describeMisses(follower.progress());
    EXPECT_EQ(misses.find("times the tolerance at point 5") != std::string::npos, strict) << misses;
  }
}

/// Two tips held, and the kind as third task a few degrees away: all errors vanish.
TEST(FurtherTasks, EveryMethodReachesAnAttainableThirdTask) {
  for (const Method method : kMethods) {
    for (const TaskKind kind : {TaskKind::kTipAxis, TaskKind::kRelativeOrientation, TaskKind::kLookAt}) {
      // As printed, each arm does the whole of a task of two arms, and a third task is not projected behind the second.
      if (method == Method::kNspwln && kind == TaskKind::kRelativeOrientation)
        continue;
      SCOPED_TRACE(std::string(control::name(method)) + " " + std::string(findTaskKind(kind)->name));
      safety::RobotVector start(12);
      start << arkStart(1, 0), arkStart(1, 1);
      TaskLoop goal(method, start), loop(method, start);
      // A goal that is attainable: the place at other joints with the same tips.
      planning::Reference tips;
      tips.task_count = 2;
      tips.tasks[0] = goal.task(TaskKind::kRelativePosition);
      tips.tasks[1] = goal.task(TaskKind::kTipPosition);
      tips.posture = start;
      tips.posture[3] += 0.25;
      tips.posture[10] -= 0.2;
      goal.go(tips, 60);
      planning::Reference reference = tips;
      reference.posture.resize(0);
      reference.task_count = 3;
      reference.tasks[2] = goal.task(kind);
      if (kind == TaskKind::kLookAt)
        reference.tasks[2].position += 0.1 * goal.result.tip[0].pose.linear().col(2);
      loop.go(reference, 1);
      const double first = loop.result.error[2];
      ASSERT_GT(first, 1e-3) << "m, radians times length";
      loop.go(reference, 150);
      EXPECT_LT(loop.result.error[2], 0.15 * first);
      EXPECT_LT(loop.result.error[0], 1e-3);
      EXPECT_LT(loop.result.error[1], 1e-3);
    }
  }
}

TEST(FurtherTasks, StepWithThemAllocatesNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  safety::RobotVector start(12);
  start << arkStart(1, 0), arkStart(1, 1);
  for (int m = 0; m < control::kMethodCount; ++m) {
    TaskLoop loop(static_cast<Method>(m), start);
    planning::Reference reference;
    reference.task_count = 4;
    reference.tasks = {loop.task(TaskKind::kRelativePosition), loop.task(TaskKind::kTipPosition),
                       loop.task(TaskKind::kTipPose, kinematics::rotationBy({0.1, 0, 0})),
                       loop.task(TaskKind::kRelativePose)};
    loop.tracker.step(loop.q, loop.q, reference, loop.result);
    const std::size_t before = allocationCount();
    for (int i = 0; i < 20; ++i)
      loop.tracker.step(loop.q, loop.q, reference, loop.result);
    EXPECT_EQ(allocationCount(), before) << control::name(static_cast<Method>(m));
  }
}

/** One curved tube; a model needs two, so a short straight one without stiffness is around it. */
struct CurvedTube {
  static constexpr double kCurvature = 12.0, kLength = 0.12;  // 1/m, m: a cap of 82.5 deg
  kinematics::ConcentricTubeArm arm;
  safety::ArmLimits limits;

  CurvedTube() {
    arm.tubes = {{1.2e-3, 0.8e-3, 60e9, 0.3, {}}, {1.6e-3, 1.4e-3, 1.0, 0.3, {}}};
    arm.tubes[0].addSection(kLength, kCurvature);
    arm.tubes[1].addSection(1e-3, 0.0);
    limits = limitsOf(arm);
  }
};

/// Closed form: a single tube of curvature kappa whose curved length is L reaches exactly the axes within kappa L of
/// its base axis, at any azimuth: the axis is tilted by kappa times the extended length, in the direction of its
/// rotation.
TEST(FurtherTasks, ASingleCurvedTubeReachesTheAxesOfItsCap) {
  constexpr double kCurvature = CurvedTube::kCurvature, kLength = CurvedTube::kLength;
  const CurvedTube tube;
  const auto model = kinematics::makeArmModel("rigid", tube.arm);
  overSeeds([&](Dice& dice) {
    for (const bool inside : {true, false}) {
      const double tilt =
          inside ? dice.uniform(0.05, 0.95) * kCurvature * kLength : kCurvature * kLength + dice.uniform(0.05, 0.5);
      const double azimuth = dice.uniform(-1.0, 1.0);  // of the arm's rotation, rad
      const Eigen::Vector3d wanted(std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth),
                                   std::cos(tilt));
      planning::Reference reference;
      reference.task_count = 1;
      reference.tasks[0].kind = TaskKind::kTipAxis;
      reference.tasks[0].orientation =
          kinematics::rotationBy(kinematics::smallestRotation(Eigen::Vector3d::UnitZ(), wanted));
      planning::ReferenceTracker tracker({model.get()}, {&tube.limits}, Method::kNspqp, {}, {});
      planning::TrackResult result;
      safety::RobotVector q(4);
      q << -0.5 * kLength, 0.0, 0.0, 0.0;
      for (int i = 0; i < 400; ++i) {
        tracker.step(q, q, reference, result);
        ASSERT_EQ(result.status, planning::TrackStatus::kOk);
        q += kStepTime * result.solution.velocity;
      }
      const double error = result.error[0] / kinematics::kLengthPerRadian;
      EXPECT_NEAR(error, inside ? 0.0 : tilt - kCurvature * kLength, 1e-6);
      EXPECT_NEAR(q[0], inside ? tilt / kCurvature - kLength : 0.0, 1e-6);
      // At the edge control turns tubes of one plane slightly against each other, in search of a way on.
      EXPECT_NEAR(q[2], azimuth, inside ? 1e-5 : 1e-3);
    }
  });
}

/// Against the rank of the stacked Jacobian, made of the models' Jacobians here.
TEST(TaskFreedom, RanksAddUpToThatOfTheStack) {
  overSeeds([](Dice& dice) {
    const Pair pair("rigid");
    Random random(static_cast<std::uint32_t>(dice.engine()));
    safety::RobotVector q;
    std::vector<kinematics::Tip> tips;
    if (!pair.known(pair.both, random, q, tips))
      return;
    auto spec = lineBy({0, 0, 0.01}, 1);
    spec.further = {further(TaskKind::kTipOrientation, 2)};
    const auto freedom = planning::taskFreedom(pair.both, spec, q);
    ASSERT_EQ(freedom.size(), 3u);
    Eigen::MatrixXd stack = Eigen::MatrixXd::Zero(9, 12);
    stack.topLeftCorner<3, 6>() = tips[0].jacobian.topRows<3>();
    stack.topRightCorner<3, 6>() = -tips[1].jacobian.topRows<3>();
    stack.middleRows<3>(3).leftCols<6>() = tips[0].jacobian.topRows<3>();
    stack.bottomRows<3>().leftCols<6>() = kinematics::kLengthPerRadian * tips[0].jacobian.bottomRows<3>();
    for (const int rotation : {3, 4, 5, 9, 10, 11})
      stack.col(rotation) /= kinematics::kLengthPerRadian;
    const Eigen::VectorXd values = stack.jacobiSvd().singularValues();
    EXPECT_NEAR(freedom[0].least, stack.topRows<3>().jacobiSvd().singularValues()[2], 1e-9);
    int rank = 0;
    for (const planning::TaskFreedom& one : freedom) {
      EXPECT_EQ(one.rows, 3);
      EXPECT_LE(one.rank, one.rows);
      rank += one.rank;
    }
    // The smallest value of the stack is a lower bound of those of each task in the null space of those before.
    if (values[8] > planning::kLostDirection) {
      EXPECT_EQ(rank, 9);
    }
    for (const planning::TaskFreedom& one : freedom)
      EXPECT_GE(one.least, values[8] - 1e-9);
  });
}

TEST(TaskFreedom, NamesTheTasksThatTakeAll) {
  const Pair pair("rigid");
  auto spec = lineBy({0, 0, 0.01}, 1);
  spec.other_arm = planning::kNoArm;
  spec.further = {further(TaskKind::kTipOrientation, 0), further(TaskKind::kTipAxis, 2)};
  safety::RobotVector q(12);
  q << arkStart(1, 0), arkStart(1, 1);
  const auto freedom = planning::taskFreedom(pair.both, spec, q);
  ASSERT_EQ(freedom.size(), 3u);
  EXPECT_TRUE(freedom[2].lost());
  EXPECT_EQ(
      planning::lostTask(freedom, {"left", "right"}),
      "axis of left: at the start the tasks before it (orientation of left, tip of left) take all degrees of freedom "
      "that move it");
  spec.further.resize(1);
  EXPECT_EQ(planning::lostTask(planning::taskFreedom(pair.both, spec, q), {}), "");
}

}  // namespace
}  // namespace tandem::test
