// SPDX-License-Identifier: Apache-2.0
/** @file Soft tasks in closed loops: joint limits and elastic stability. */
#include <gtest/gtest.h>

#include <cstdio>

#include "planning/follower.h"
#include "planning/task_freedom.h"
#include "task_loop.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::test {
namespace {

using control::Method;
using planning::TaskKind;

constexpr double kD = 0.005;       ///< of joint limits, m
constexpr double kStable = 0.5;    ///< of stability
constexpr double kStopped = 2e-4;  ///< a joint this near to a limit is at it, m

constexpr std::array kKeepOrder{Method::kNspwlnJoint, Method::kNspqp, Method::kSnsqp, Method::kSns, Method::kHqp};

planning::TaskReference soft(TaskKind kind, int arm, double distance) {
  planning::TaskReference task;
  task.kind = kind;
  task.arm = arm;
  task.position.x() = distance;
  return task;
}

planning::TaskReference tipAt(const Eigen::Vector3d& position, int arm = 0) {
  planning::TaskReference task;
  task.kind = TaskKind::kTipPosition;
  task.arm = arm;
  task.position = position;
  return task;
}

planning::Reference listOf(std::initializer_list<planning::TaskReference> tasks) {
  planning::Reference reference;
  for (const planning::TaskReference& task : tasks)
    reference.tasks[static_cast<std::size_t>(reference.task_count++)] = task;
  return reference;
}

/** What a motion came near to. */
struct Motion {
  double least = 1e9;  ///< distance from the limits, or stability
  double tip = 0.0;    ///< error at the end, m
};

/** One arm of the pair that follows the tracker exactly. */
struct OneArm {
  const Pair& pair;
  planning::ReferenceTracker tracker;
  planning::TrackResult result;
  safety::RobotVector q;

  OneArm(const Pair& two, Method method, const safety::RobotVector& start)
      : pair(two), tracker(two.one.models, two.one.limits, method, {}, {5.0, 3.0}), q(start) {
    EXPECT_TRUE(tracker.computeTips(q, result));
  }
  double distance(TaskKind kind, double d) const {
    return tracker.tips().avoidance(0, kinematics::findTaskKind(kind)->point, d).least;
  }
  /// The tip's target moves from where the tip is, straight to its place in the reference.
  Motion go(const planning::Reference& reference, TaskKind kind, double d, int steps) {
    Motion motion;
    const Eigen::Vector3d from = result.tip[0].pose.translation();
    for (int i = 0; i < steps; ++i) {
      planning::Reference now = reference;
      const double share = std::min(1.0, 1.25 * i / steps);
      for (planning::TaskReference& task : now.tasks) {
        if (task.kind == TaskKind::kTipPosition)
          task.position = from + share * (task.position - from);
      }
      tracker.step(q, q, now, result);
      EXPECT_EQ(result.status, planning::TrackStatus::kOk);
      q += kStepTime * result.solution.velocity;
      EXPECT_TRUE(tracker.computeTips(q, result));
      motion.least = std::min(motion.least, distance(kind, d));
    }
    for (int t = 0; t < reference.task_count; ++t) {
      const planning::TaskReference& task = reference.tasks[static_cast<std::size_t>(t)];
      if (task.kind == TaskKind::kTipPosition)
        motion.tip = (task.position - result.tip[0].pose.translation()).norm();
    }
    return motion;
  }
};

/** Motions from random joints, at least d away, to the tips of others: without the task, with it behind the tip, and
 * with it before. */
struct Comparison {
  int ways = 0;
  int hits[3] = {}, reached[3] = {};
  double least[3] = {1e9, 1e9, 1e9};

  void run(const Pair& pair, Method method, TaskKind kind, double d, double hit, double reserve, int trials) {
    for (std::uint32_t seed = baseSeed(); seed < baseSeed() + static_cast<std::uint32_t>(trials); ++seed) {
      SCOPED_TRACE(trace(seed));
      Random random(seed);
      safety::RobotVector from, to;
      std::vector<kinematics::Tip> at_start, at_end;
      if (!pair.known(pair.one, random, from, at_start) || !pair.known(pair.one, random, to, at_end) ||
          OneArm(pair, method, from).distance(kind, d) < reserve)
        continue;
      ++ways;
      const auto tip = tipAt(at_end[0].pose.translation()), away = soft(kind, 0, d);
      const planning::Reference lists[] = {listOf({tip}), listOf({tip, away}), listOf({away, tip})};
      for (int k = 0; k < 3; ++k) {
        const Motion motion = OneArm(pair, method, from).go(lists[k], kind, d, 200);
        hits[k] += motion.least < hit ? 1 : 0;
        reached[k] += motion.tip < 1e-3 ? 1 : 0;
        least[k] = std::min(least[k], motion.least);
      }
    }
    std::printf(
        "  %-12s %s: %d ways; at it %d, %d behind the tip, %d before; reached %d, %d, %d; least %.3g %.3g %.3g\n",
        std::string(control::name(method)).c_str(), std::string(kinematics::findTaskKind(kind)->name).c_str(), ways,
        hits[0], hits[1], hits[2], reached[0], reached[1], reached[2], least[0], least[1], least[2]);
  }
};

TEST(SoftTasks, JointsKeepAwayFromLimitsThatTheyRunInto) {
  const Pair pair("rigid");
  for (const Method method : {Method::kNspqp, Method::kSnsqp, Method::kSns, Method::kHqp}) {  // with hard limits
    Comparison all;
    all.run(pair, method, TaskKind::kJointLimits, kD, kStopped, kD, 100);
    EXPECT_GT(all.hits[0], 5);
    EXPECT_LT(all.hits[1], 0.7 * all.hits[0]) << "behind the tip";
    EXPECT_GE(all.reached[1], 0.8 * all.reached[0]) << "on another way, most of it is reached";
    EXPECT_EQ(all.hits[2], 0) << "before the tip";
    EXPECT_GT(all.least[2], 0.15 * kD) << "a joint's step is 1 mm at most";
  }
}

/// At the same joints the tip moves as it does alone.
TEST(SoftTasks, BehindTheTipItDoesNotDisturbIt) {
  const Pair pair("rigid");
  for (const Method method : {Method::kNspwlnJoint, Method::kNspqp, Method::kSnsqp, Method::kSns, Method::kHqp}) {
    int compared = 0;
    for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 200; ++seed) {
      SCOPED_TRACE(std::string(control::name(method)) + " " + trace(seed));
      Random random(seed);
      safety::RobotVector q;
      std::vector<kinematics::Tip> tips;
      if (!pair.known(pair.one, random, q, tips))
        continue;
      OneArm arm(pair, method, q);
      const auto tip = tipAt(tips[0].pose.translation() + anyVector(random, 1e-4));
      arm.tracker.step(q, q, listOf({tip}), arm.result);
      if (arm.result.status != planning::TrackStatus::kOk || arm.result.solution.residual[0] > 1e-6)
        continue;  // limits or a singular pose hold the tip back
      const Eigen::VectorXd alone = arm.result.solution.velocity;
      arm.tracker.step(q, q, listOf({tip, soft(TaskKind::kJointLimits, 0, kD)}), arm.result);
      EXPECT_LT(arm.result.solution.residual[0], 5e-6) << "of up to 5e-4 m/s";
      compared += (arm.result.solution.velocity - alone).norm() > 1e-4 ? 1 : 0;
    }
    EXPECT_GT(compared, 5) << control::name(method);
  }
}

TEST(SoftTasks, ArmsKeepTheirStability) {
  const Pair pair("compliant");
  for (const Method method : {Method::kNspqp, Method::kHqp}) {
    Comparison all;
    all.run(pair, method, TaskKind::kElasticStability, kStable, 0.6 * kStable, kStable, 150);
    EXPECT_GT(all.hits[0], 2);
    EXPECT_LT(all.hits[1], all.hits[0]);
    EXPECT_GE(all.reached[1], all.reached[0] - 1);
    EXPECT_LT(all.hits[2], all.hits[1] + 1);
  }
}

/// The velocity is the same, up to the length of the step, on both sides of the place at which the task begins.
TEST(SoftTasks, NothingJumpsWhereTheTaskBegins) {
  constexpr double kStep = 1e-9;
  int compared = 0;
  double largest = 0.0;
  for (int m = 0; m < control::kMethodCount; ++m) {
    const auto method = static_cast<Method>(m);
    for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 30; ++seed) {
      SCOPED_TRACE(std::string(control::name(method)) + " " + trace(seed));
      Random random(seed);
      const Pair pair("rigid");
      safety::RobotVector q;
      std::vector<kinematics::Tip> tips;
      if (!pair.known(pair.one, random, q, tips))
        continue;
      // The innermost tube, kD behind the limit that its neighbour is, all else far from limits.
      q << -0.15, -0.10, -0.05, random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1);
      const double gap = -0.10 - -0.15 - kD;
      const auto at = [&](double beyond, int place) {
        safety::RobotVector there = q;
        there[0] += gap + beyond;
        OneArm arm(pair, method, there);
        const auto tip = tipAt(arm.result.tip[0].pose.translation() + Eigen::Vector3d(2e-4, 3e-4, 5e-4));
        const auto away = soft(TaskKind::kJointLimits, 0, kD);
        arm.tracker.step(there, there, place == 0 ? listOf({away, tip}) : listOf({tip, away}), arm.result);
        EXPECT_EQ(arm.result.status, planning::TrackStatus::kOk);
        return Eigen::VectorXd(arm.result.solution.velocity);
      };
      for (const int place : {0, 1}) {
        const double jump = (at(kStep, place) - at(-kStep, place)).norm();
        largest = std::max(largest, jump);
        EXPECT_LT(jump, 1e-6) << "place " << place;
        ++compared;
      }
    }
  }
  std::printf("  %d places, largest difference %.3g\n", compared, largest);
  EXPECT_GT(compared, 200);
}

/// One to four arms, each with limits of its own: only the joints of the arm of a task move away.
TEST(SoftTasks, ActOnTheirOwnArmOfUpToFour) {
  const auto model = kinematics::makeArmModel("rigid", arkArm(0.0));
  const safety::ArmLimits limits = limitsOf(arkArm(0.0));
  for (int arms = 1; arms <= 4; ++arms) {
    const std::vector<const kinematics::ArmModel*> models(static_cast<std::size_t>(arms), model.get());
    const std::vector<const safety::ArmLimits*> all(static_cast<std::size_t>(arms), &limits);
    for (const Method method : kKeepOrder) {
      SCOPED_TRACE(std::string(control::name(method)) + " " + std::to_string(arms));
      planning::ReferenceTracker tracker(models, all, method, {}, {5.0, 3.0});
      planning::TrackResult result;
      safety::RobotVector q(6 * arms);
      for (int k = 0; k < arms; ++k)
        q.segment(6 * k, 6) << -0.15, -0.149, -0.05, 0.3, -0.2, 0.1;  // 1 mm behind the neighbour
      ASSERT_TRUE(tracker.computeTips(q, result));
      const int last = arms - 1;
      const Eigen::Vector3d tip = result.tip[0].pose.translation();
      tracker.step(q, q, listOf({tipAt(tip), soft(TaskKind::kJointLimits, last, kD)}), result);
      ASSERT_EQ(result.status, planning::TrackStatus::kOk);
      const auto velocity = result.solution.velocity.segment(6 * last, 6);
      EXPECT_GT(velocity[1] - velocity[0], 1e-4) << "the neighbours part";
      EXPECT_NEAR(result.error[1], std::pow(kD - 1e-3, 2) / (2.0 * kD), 1e-12);
      for (int k = 0; k < last; ++k)
        EXPECT_LT(result.solution.velocity.segment(6 * k, 3).norm(), method == Method::kHqp ? 1.0 : 1e-9) << k;
    }
  }
}

TEST(SoftTasks, AreRefusedWhereTheModelCannotSnapAndWithoutADistance) {
  const Pair rigid("rigid"), compliant("compliant");
  auto spec = lineBy({0, 0, 0.01}, 4);
  spec.further = {further(TaskKind::kElasticStability, 2)};
  EXPECT_NE(spec.wrongModels(rigid.both.models).find("expected concentric tubes with the compliant model"),
            std::string::npos);
  EXPECT_EQ(spec.wrongModels(compliant.both.models), "");
  spec.further = {further(TaskKind::kJointLimits, 2)};
  EXPECT_EQ(spec.wrongModels(rigid.both.models), "");
  OneArm arm(rigid, Method::kNspqp, arkStart(1, 0));
  arm.tracker.step(arm.q, arm.q, listOf({soft(TaskKind::kJointLimits, 0, 0.0)}), arm.result);
  EXPECT_EQ(arm.result.status, planning::TrackStatus::kReference);
}

/// The check before a run says how near the path comes, and refuses nothing for it.
TEST(SoftTasks, FreedomHasTheLeastDistanceOfThePath) {
  const Pair pair("rigid");
  auto spec = lineBy({0, 0, 0.01}, 2);
  spec.other_arm = planning::kNoArm;
  spec.further = {further(TaskKind::kJointLimits, 0)};
  spec.further[0].target.x() = kD;
  Eigen::MatrixXd path(6, 3);
  path.colwise() = Eigen::VectorXd(arkStart(1, 0));
  path(1, 1) = path(0, 1) + 2e-3;
  path(1, 2) = path(0, 2) + 4e-3;
  const auto freedom = planning::taskFreedom(pair.one, spec, path);
  ASSERT_EQ(freedom.size(), 2u);
  EXPECT_TRUE(freedom[0].soft());
  EXPECT_NEAR(freedom[0].nearest, 2e-3, 1e-9);
  EXPECT_EQ(freedom[0].nearest_point, 1);
  EXPECT_EQ(freedom[0].near_points, 2);
  EXPECT_EQ(planning::lostTask(freedom, {"a"}), "");
  EXPECT_FALSE(freedom[1].soft());
  EXPECT_EQ(freedom[1].rank, 3);
}

/// Its error in reports is C, at the joints of the tips.
TEST(SoftTasks, FollowerReportsTheNearness) {
  const Pair pair("rigid");
  auto spec = lineBy({0, 0, 1e-3}, 1);
  spec.other_arm = planning::kNoArm;
  spec.max_iterations = 1;
  spec.further = {further(TaskKind::kJointLimits, 1)};
  spec.further[0].target.x() = kD;
  planning::TipFollower tips(pair.one.models, pair.one.limits);
  safety::RobotVector q = arkStart(1, 0);
  q[1] = q[0] + 2e-3;
  ASSERT_TRUE(tips.update(q));
  planning::Follower follower(kStepTime);
  follower.start(spec, planning::pointAt(spec, tips, nullptr));
  planning::Reference reference;
  ASSERT_TRUE(follower.update(tips, nullptr, reference));
  ASSERT_EQ(reference.task_count, 2);
  EXPECT_EQ(reference.tasks[1].position, Eigen::Vector3d(kD, 0, 0));
  EXPECT_TRUE(reference.tasks[1].feed_forward.isZero(0.0));
  EXPECT_FALSE(follower.update(tips, nullptr, reference));
  EXPECT_NEAR(follower.errors()[1].maximum(), std::pow(kD - 2e-3, 2) / (2.0 * kD), 1e-12);
}

TEST(SoftTasks, StepAllocatesNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  for (const char* model : {"rigid", "compliant"}) {
    const Pair pair(model);
    for (int m = 0; m < control::kMethodCount; ++m) {
      safety::RobotVector q = arkStart(1, 0);
      q[1] = q[0] + 0.7 * kD;  // blended in
      OneArm arm(pair, static_cast<Method>(m), q);
      const auto reference = listOf({soft(TaskKind::kJointLimits, 0, kD), soft(TaskKind::kElasticStability, 0, 0.999),
                                     tipAt(arm.result.tip[0].pose.translation())});
      arm.tracker.step(q, q, reference, arm.result);
      EXPECT_GT(arm.tracker.problem().task[0].activation, 0.0);
      EXPECT_LT(arm.tracker.problem().task[0].activation, 1.0);
      const std::size_t before = allocationCount();
      for (int i = 0; i < 20; ++i)
        arm.tracker.step(q, q, reference, arm.result);
      EXPECT_EQ(allocationCount(), before) << control::name(static_cast<Method>(m));
    }
  }
}

}  // namespace
}  // namespace tandem::test
