// SPDX-License-Identifier: Apache-2.0
#include "planning/timing.h"

#include <gtest/gtest.h>

#include "planning/start_choice.h"
#include "tests/unit/planning/arm_pair.h"

namespace tandem::test {
namespace {

using namespace planning;

constexpr double kNone = safety::kUnlimited;

TEST(Timing, WithoutAccelerationLimitsTheSlowestJointDeterminesEachSegment) {
  TimingProblem problem;
  problem.path.resize(2, 3);
  problem.path << 0.0, 0.01, 0.01, 0.0, 0.1, 0.5;
  problem.velocity = Eigen::Vector2d(5e-3, 0.5);
  problem.acceleration = Eigen::Vector2d(kNone, kNone);
  const Timing timing = timeOptimal(problem);
  ASSERT_EQ(timing.status, TimingStatus::kOptimal);
  EXPECT_NEAR(timing.time[1], 2.0, 1e-12);
  EXPECT_NEAR(timing.time[2], 2.8, 1e-12);
  EXPECT_EQ(timing.limiting, (std::vector<int>{0, 1}));
  problem.velocity[1] = kNone;
  EXPECT_EQ(timeOptimal(problem).status, TimingStatus::kUnlimited);
  problem.velocity[1] = -1.0;
  EXPECT_EQ(timeOptimal(problem).status, TimingStatus::kInvalid);
}

TEST(Timing, OfAStraightLineIsTheTrapezium) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int trial = 0; trial < 20; ++trial) {
    const double length = random.uniform(0.01, 0.1), v = random.uniform(2e-3, 2e-2), a = random.uniform(2e-3, 2e-2);
    TimingProblem problem;
    problem.path.resize(1, 201);
    for (int k = 0; k <= 200; ++k)
      problem.path(0, k) = length * k / 200;
    problem.velocity = Eigen::VectorXd::Constant(1, v);
    problem.acceleration = Eigen::VectorXd::Constant(1, a);
    const Timing timing = timeOptimal(problem);
    ASSERT_EQ(timing.status, TimingStatus::kOptimal);
    const double expected = length < v * v / a ? 2.0 * std::sqrt(length / a) : length / v + v / a;
    EXPECT_NEAR(timing.total(), expected, 0.01 * expected);
  }
}

/// Largest x of every point by forward and backward passes until convergence: slow, and independent of Ipopt.
double bruteForceTime(const TimingProblem& p) {
  const int last = static_cast<int>(p.path.cols()) - 1;
  const auto feasible = [&](int k, double x0, double x1) {  // piece k
    for (int at : {k, k + 1}) {
      const int before = std::max(0, at - 1), after = std::min(last, at + 1);
      for (int j = 0; j < p.path.rows(); ++j) {
        const double slope = (p.path(j, after) - p.path(j, before)) / (after - before);
        const double bend = after - before == 2 ? p.path(j, after) - 2.0 * p.path(j, at) + p.path(j, before) : 0.0;
        if (std::abs(slope * (x1 - x0) / 2.0 + bend * (at == k ? x0 : x1)) > p.acceleration[j] * (1.0 + 1e-12))
          return false;
      }
    }
    return true;
  };
  // Dynamic programming over a grid of sqrt(x), common to all points.
  double most = 0.0;
  for (int k = 0; k < last; ++k)
    most = std::max(most, 1.0 / (p.path.col(k + 1) - p.path.col(k)).cwiseAbs().cwiseQuotient(p.velocity).maxCoeff());
  constexpr int kGrid = 400;
  std::vector<double> cost(kGrid + 1, 1e300);
  cost[0] = 0.0;
  for (int k = 0; k < last; ++k) {
    const double cap = 1.0 / (p.path.col(k + 1) - p.path.col(k)).cwiseAbs().cwiseQuotient(p.velocity).maxCoeff();
    std::vector<double> next(kGrid + 1, 1e300);
    for (int i = 0; i <= kGrid; ++i) {
      for (int j = 0; j <= kGrid && cost[i] < 1e299; ++j) {
        const double r0 = most * i / kGrid, r1 = most * j / kGrid;
        if (i + j > 0 && r0 <= cap && r1 <= cap && feasible(k, r0 * r0, r1 * r1))
          next[j] = std::min(next[j], cost[i] + 2.0 / (r0 + r1));
      }
    }
    cost = next;
  }
  return cost[0];
}

TEST(Timing, OfRandomPathsKeepsTheLimitsAndIsNotSlowerThanADynamicProgramme) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int trial = 0; trial < 6; ++trial) {
    TimingProblem problem;
    problem.path.resize(3, 13);
    for (int j = 0; j < 3; ++j) {
      const double phase = random.uniform(0, 6), size = random.uniform(5e-3, 2e-2), turns = random.uniform(0.5, 3.0);
      for (int k = 0; k < 13; ++k)
        problem.path(j, k) = size * std::sin(phase + turns * k / 12.0);
    }
    problem.velocity = Eigen::Vector3d::Constant(5e-3);
    problem.acceleration = Eigen::Vector3d::Constant(random.uniform(2e-3, 1e-2));
    const Timing timing = timeOptimal(problem);
    ASSERT_EQ(timing.status, TimingStatus::kOptimal);
    for (int k = 0; k < 12; ++k) {
      const double dt = timing.time[k + 1] - timing.time[k];
      ASSERT_GT(dt, 0.0);
      const Eigen::VectorXd v = (problem.path.col(k + 1) - problem.path.col(k)).cwiseAbs() / dt;
      EXPECT_LE(v.maxCoeff(), 5e-3 * (1.0 + 1e-6));
    }
    const double brute = bruteForceTime(problem);
    EXPECT_LE(timing.total(), brute * (1.0 + 1e-6));
    EXPECT_GE(timing.total(), 0.85 * brute) << "the grid is coarse";
  }
}

TEST(StartChoice, LeavesAtLeastTheRoomOfTheGivenStart) {
  const Pair robot("rigid");
  safety::RobotVector given(12);
  given << arkStart(1, 0), arkStart(1, 1);
  TrajectorySpec spec;
  spec.shape = Line{{0, 5e-3, 5e-3}};
  spec.point_count = 4;
  StartOptions options;
  options.tries = 6;
  const StartChoice choice = chooseStart(robot.both, spec, given, options);
  ASSERT_GT(choice.candidates.size(), 1u);
  kinematics::Tip wanted, found;
  ASSERT_EQ(robot.a->tip(given.head(6), wanted), kinematics::ModelStatus::kOk);
  for (const StartCandidate& candidate : choice.candidates) {
    ASSERT_EQ(robot.a->tip(candidate.q.head(6), found), kinematics::ModelStatus::kOk);
    EXPECT_LT((wanted.pose.translation() - found.pose.translation()).norm(), 1e-6);
    const FeasibilityReport report = checkTrajectory(robot.both, spec, candidate.q, {});
    EXPECT_EQ(report.unreachable(), candidate.unreachable);
    double room = roomAt(robot.both, candidate.q, kNone, {});
    for (const PointReport& point : report.points)
      room = std::min(room, roomAt(robot.both, point.q, point.stability, {}));
    EXPECT_NEAR(room, candidate.room, 1e-12);
    EXPECT_GE(choice.candidates.front().room + 1e-6, candidate.unreachable > 0 ? -kNone : candidate.room);
  }
}

}  // namespace
}  // namespace tandem::test
