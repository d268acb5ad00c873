// SPDX-License-Identifier: Apache-2.0
#include "planning/feasibility.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "tests/unit/planning/arm_pair.h"

namespace tandem::test {
namespace {

using namespace planning;

safety::RobotVector start(int configuration) {
  safety::RobotVector q(12);
  q << arkStart(configuration, 0), arkStart(configuration, 1);
  return q;
}

TrajectorySpec straight(const Eigen::Vector3d& displacement, int points) {
  TrajectorySpec spec;
  spec.name = "line";
  spec.shape = Line{displacement};
  spec.point_count = points;
  return spec;
}

/// Checks a report: feasible points are within limits, reach their tips, and do not jump.
void expectTrue(const Pair& robot, const FeasibilityReport& report, const safety::RobotVector& from) {
  safety::RobotVector before = from;
  for (const PointReport& point : report.points) {
    for (int k = 0; k < 2; ++k)
      EXPECT_LE(safety::largestViolation(robot.limits, point.q.segment(6 * k, 6)), 1e-9) << point.point;
    if (point.reach == Reach::kReached) {
      EXPECT_LE(point.error, 1e-5) << point.point;
      EXPECT_LE(point.relative_error, 1e-5) << point.point;
      EXPECT_LT((point.q - before).cwiseAbs().maxCoeff(), 1.5 + 1e-9) << point.point;
    } else {
      EXPECT_FALSE(point.reason.empty());
    }
    before = point.q;
  }
}

TEST(Feasibility, TheTrajectoriesOfTable3CanBeRun) {
  const Pair robot("rigid");
  for (const int configuration : {0, 1, 2}) {
    TrajectorySpec spec;
    spec.point_count = 50;
    if (configuration == 0)
      spec.shape = Rectangle{{-20e-3, 0, 0}, {0, 0, 20e-3}};
    else
      spec.shape = Rectangle{{0, 20e-3, 0}, {-20e-3, 0, 0}};
    const auto report = checkTrajectory(robot.both, spec, start(configuration), {});
    for (const PointReport& point : report.points)
      EXPECT_EQ(point.reach, Reach::kReached) << configuration << ", point " << point.point << ": " << point.reason;
    EXPECT_TRUE(report.feasible) << configuration << " " << report.start;
    expectTrue(robot, report, start(configuration));
    spec.shape = Lissajous{{0, 10e-3, 10e-3}, {0, 1, 2}, {0, 0, 0}};
    EXPECT_TRUE(checkTrajectory(robot.both, spec, start(configuration), {}).feasible) << configuration;
  }
}

TEST(Feasibility, APlanarStartGoesInwardAndIsRefusedOutward) {
  const Pair robot("rigid");
  // Configuration 3: all tubes bend toward +x. Away from the axis only translations could help, and they are at their
  // limits; toward it the tubes rotate against each other, which the Jacobian there does not show.
  const auto inward = checkTrajectory(robot.both, straight({-50e-3, 0, 0}, 25), start(2), {});
  EXPECT_TRUE(inward.planar_start) << inward.rotation_conditioning;
  EXPECT_TRUE(inward.feasible);
  for (const PointReport& point : inward.points)
    EXPECT_EQ(point.reach, Reach::kReached) << point.point << ": " << point.reason;
  expectTrue(robot, inward, start(2));
  const auto outward = checkTrajectory(robot.both, straight({80e-3, 0, -40e-3}, 15), start(2), {});
  EXPECT_FALSE(outward.feasible);
  const Reach reach = outward.points.back().reach;
  EXPECT_TRUE(reach == Reach::kOutsideWorkspace || reach == Reach::kLimits) << name(reach);
  std::printf("outward: %d of 15 refused, last: %s\n", outward.unreachable(), outward.points.back().reason.c_str());
  expectTrue(robot, outward, start(2));
}

TEST(Feasibility, ARepairedTrajectoryIsFeasibleAndLeavesTheRestAlone) {
  const Pair robot("rigid");
  const TrajectorySpec spec = straight({0, 0, 250e-3}, 25);  // farther than the tubes reach
  FeasibilityOptions options;
  int calls = 0;
  options.progress = [&calls](int, int points) {
    ++calls;
    EXPECT_EQ(points, 25);
  };

  const RepairResult repair = repairTrajectory(robot.both, spec, start(1), options);
  EXPECT_FALSE(repair.before.feasible);
  EXPECT_GT(repair.before.unreachable(), 0);
  EXPECT_TRUE(repair.after.feasible) << repair.rounds << " rounds";
  EXPECT_EQ(calls, 25 * (repair.rounds + 1));
  expectTrue(robot, repair.before, start(1));
  expectTrue(robot, repair.after, start(1));
  // Every point is as near to the wanted one as the nearest one found for it, except for the smoothing.
  const double allowed = repair.before.points.back().error;
  std::printf("%d unreachable, %d rounds, moved by %.1f mm at most\n", repair.before.unreachable(), repair.rounds,
              1e3 * repair.largest_change);
  EXPECT_LT(repair.largest_change, 1.5 * allowed + 1e-3);
}

/// Arms that overlap wherever they stand are refused at the start, before any point is searched for.
TEST(Feasibility, AStartWithOverlappingArmsIsRefusedBeforeThePoints) {
  FeasibilityOptions options;
  options.ik.demands.clearance = 0.0;
  int points = 0;
  options.progress = [&points](int, int) { ++points; };
  const Pair overlapping("rigid", 0.0005);
  const auto refused = checkTrajectory(overlapping.both, straight({1e-3, 0, 0}, 2), start(1), options);
  EXPECT_NE(refused.start.find("the distance of the arms is -"), std::string::npos) << refused.start;
  EXPECT_FALSE(refused.feasible);
  EXPECT_TRUE(refused.points.empty());
  EXPECT_EQ(points, 0);
  options.ik.demands.clearance.reset();
  EXPECT_TRUE(checkTrajectory(overlapping.both, straight({1e-3, 0, 0}, 2), start(1), options).feasible);
  // An overlap that joints near the start end is no reason to refuse.
  options.ik.demands.clearance = 0.0;
  const Pair ark("rigid");
  EXPECT_EQ(checkTrajectory(ark.both, straight({1e-3, 0, 0}, 2), start(1), options).start, "");
}

TEST(Feasibility, InvalidStartAndCancellationAreDistinguished) {
  const Pair robot("rigid");
  safety::RobotVector q = start(1);
  q[1] = q[0] - 0.01;  // carriage 2 behind carriage 1
  EXPECT_NE(checkTrajectory(robot.both, straight({1e-3, 0, 0}, 2), q, {}).start, "");
  FeasibilityOptions options;
  int left = 30;
  options.ik.cancelled = [&left] { return --left < 0; };
  const auto report = checkTrajectory(robot.both, straight({5e-3, 0, 0}, 50), start(1), options);
  EXPECT_TRUE(report.cancelled);
  EXPECT_FALSE(report.feasible);
  EXPECT_LT(report.points.size(), 50u);
}

}  // namespace
}  // namespace tandem::test
