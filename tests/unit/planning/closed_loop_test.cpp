// SPDX-License-Identifier: Apache-2.0
/** @file Random tasks in closed loop, beside what plan check says of them beforehand. */
#include <gtest/gtest.h>

#include "planning/feasibility.h"
#include "planning/follower.h"
#include "planning/reference_tracker.h"
#include "tests/unit/planning/arm_pair.h"

namespace tandem::test {
namespace {

using namespace planning;

constexpr double kPeriod = 0.1;

/// Joints inside the limits; now and then all tubes of both arms in one plane.
safety::RobotVector anyStart(const Pair& robot, Random& random) {
  safety::RobotVector q(12);
  q << randomInside(robot.limits, random), randomInside(robot.limits, random);
  if (random.chance(0.2)) {
    q.segment(3, 3).setConstant(q[3]);
    q.tail(3).setConstant(q[9]);
  }
  return q;
}

TrajectorySpec anyTask(Random& random) {
  const Eigen::Vector3d way =
      0.02 * Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
  TrajectorySpec spec;
  spec.name = "random";
  spec.point_count = 10;
  if (random.chance(0.5))
    spec.shape = Line{way};
  else
    spec.shape = Circle{0.5 * way, way.unitOrthogonal(), 1.0};
  return spec;
}

struct Outcome {
  bool completed = false;
  double violation = 0.0;  ///< largest of equation (1) and of the boxes, m or rad
  double rotation = 0.0;   ///< fastest, rad/s
};

Outcome run(const Pair& robot, const TrajectorySpec& spec, safety::RobotVector q, control::Method method) {
  ReferenceTracker tracker(robot.both.models, robot.both.limits, method, {}, {});
  Follower follower(kPeriod);
  TrackResult result;
  Outcome outcome;
  if (!tracker.computeTips(q, result))
    return outcome;
  const auto tip = [&](int k) { return Eigen::Vector3d(result.tip[static_cast<std::size_t>(k)].pose.translation()); };
  follower.start(spec, tip(0), tip(0) - tip(1));
  Reference reference;
  while (follower.update(tip(0), tip(0) - tip(1), reference)) {
    tracker.step(q, q, reference, result);
    if (result.status != TrackStatus::kOk)
      return outcome;
    const safety::RobotVector& velocity = result.solution.velocity;
    q += kPeriod * velocity;
    for (int k = 0; k < 2; ++k) {
      q.segment(6 * k, 3) = q.segment(6 * k, 3).cwiseMin(0.0);  // rounding
      outcome.violation = std::max(outcome.violation, safety::largestViolation(robot.limits, q.segment(6 * k, 6)));
      outcome.rotation = std::max(outcome.rotation, velocity.segment(6 * k + 3, 3).cwiseAbs().maxCoeff());
    }
    if (!tracker.computeTips(q, result))
      return outcome;
  }
  outcome.completed = follower.progress().phase == Phase::kFinished;
  return outcome;
}

/// A method looks one step ahead, so it may stall where a way exists; it never breaks a limit.
TEST(ClosedLoop, NoTaskBreaksALimitAndRefusalsHaveReasons) {
  const Pair robot("rigid");
  int feasible = 0, completed = 0, refused = 0, missed = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(14); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const safety::RobotVector start = anyStart(robot, random);
    const TrajectorySpec spec = anyTask(random);
    kinematics::Tip tip;
    if (robot.a->tip(start.head(6), tip) != kinematics::ModelStatus::kOk ||
        robot.b->tip(start.tail(6), tip) != kinematics::ModelStatus::kOk)
      continue;
    const FeasibilityReport report = checkTrajectory(robot.both, spec, start, {});
    for (const control::Method method : {control::Method::kNspqp, control::Method::kSnsqp}) {
      const Outcome outcome = run(robot, spec, start, method);
      EXPECT_LT(outcome.violation, 1e-9) << control::name(method);
      EXPECT_LE(outcome.rotation, control::MethodParameters{}.rotation_velocity + 1e-9) << control::name(method);
      if (report.feasible) {
        ++feasible;
        completed += outcome.completed ? 1 : 0;
      } else {
        ++refused;
        missed += outcome.completed ? 1 : 0;  // within 0.88 mm, where the check wants 0.01 mm
        for (const PointReport& point : report.points)
          EXPECT_TRUE(point.reach == Reach::kReached || !point.words.empty());
      }
    }
  }
  EXPECT_GT(feasible, 0);
  EXPECT_GE(2 * completed, feasible);
  EXPECT_LE(20 * missed, refused);
}

}  // namespace
}  // namespace tandem::test
