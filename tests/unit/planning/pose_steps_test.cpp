// SPDX-License-Identifier: Apache-2.0
// Inverse kinematics by steps, with Ipopt as judge.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "planning/detail/pose_solvers.h"
#include "tests/unit/planning/arm_pair.h"

namespace tandem::test {
namespace {

using namespace planning;

/// A problem whose targets are the tips of joints near the reference, and its start: the reference inside the limits.
bool nearProblem(const Pair& robot, Random& random, PoseProblem& problem, safety::RobotVector& start) {
  const Arms& arms = robot.both;
  std::vector<kinematics::Tip> tips;
  if (!robot.known(arms, random, start, tips))
    return false;
  safety::RobotVector there = start;
  for (int j = 0; j < there.size(); ++j)
    there[j] += random.uniform(-0.05, 0.05) * PoseProblem::unit(arms, j);
  problem = {&arms, {}, start, {}, false, false, {}};
  for (int k = 0; k < arms.count(); ++k) {
    const auto arm = static_cast<std::size_t>(k);
    const safety::ArmVector own = there.segment(arms.offset(k), arms.size(k));
    kinematics::Branch branch;
    kinematics::Tip tip;
    if (arms.models[arm]->tip(start.segment(arms.offset(k), arms.size(k)), branch, tip) != kinematics::ModelStatus::kOk)
      return false;
    problem.branches.push_back(branch);
    if (safety::largestViolation(robot.limits, own) > 0.0 ||
        arms.models[arm]->tip(own, branch, tip) != kinematics::ModelStatus::kOk)
      return false;
    problem.targets.push_back({k, tip.pose.translation(), {}});
    if (random.uniform(0.0, 1.0) < 0.3)
      problem.targets.back().orientation = Eigen::Quaterniond(tip.pose.linear());
  }
  return true;
}

double violation(const PosePoint& point) {
  return std::max((point.lower - point.constraints).maxCoeff(), (point.constraints - point.upper).maxCoeff());
}

/// grad f + J' lambda + mu, relative to the gradient.
double stationarity(const PosePoint& point, const PoseSolution& solution) {
  const Eigen::VectorXd sum =
      point.gradient + point.jacobian.transpose() * solution.multipliers + solution.joint_multipliers;
  return sum.cwiseAbs().maxCoeff() / std::max(1e-3, point.gradient.cwiseAbs().maxCoeff());
}

/// All steps end at joints that satisfy the constraints; nearly all at the joints that Ipopt finds, and none far from
/// them. Where the tip's derivative jumps, there is no gradient to compare, only the objective.
void compareWithIpopt(const char* model, bool demands, std::uint32_t count) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  const Pair robot(model);
  int answered = 0, stationary = 0, compared = 0, longer = 0;
  for (std::uint32_t done = 0; done < count;) {
    PoseProblem problem;
    safety::RobotVector start;
    if (!nearProblem(robot, random, problem, start))
      continue;
    ++done;
    if (demands)
      problem.demands.stability = 0.02;
    const std::optional<PoseSolution> steps = solveBySteps(problem, start);
    if (!steps)
      continue;
    ++answered;
    const PosePoint point = evaluate(problem, steps->q);
    ASSERT_TRUE(point.answered);
    EXPECT_LT(violation(point), 1e-8);
    stationary += stationarity(point, *steps) < 1e-6 ? 1 : 0;
    const PoseSolution judge = solveByIpopt(problem, start, 100, {});
    const PosePoint best = evaluate(problem, judge.q);
    if (!judge.solved || !best.answered || violation(best) > 1e-6)
      continue;
    ++compared;
    longer += point.objective > 1.01 * best.objective + 1e-9 ? 1 : 0;
  }
  std::printf("of %u: %d by steps, %d stationary; of %d compared %d longer than Ipopt's\n", count, answered, stationary,
              compared, longer);
  EXPECT_GT(answered, 0.9 * count);
  EXPECT_GT(stationary, 0.8 * answered);
  EXPECT_LT(longer, 0.05 * compared + 2.0);
}

TEST(PoseSteps, AgreeWithIpopt) { compareWithIpopt("rigid", false, cases(200)); }
TEST(PoseSteps, AgreeWithIpoptForCompliantArms) { compareWithIpopt("compliant", true, cases(60)); }

}  // namespace
}  // namespace tandem::test
