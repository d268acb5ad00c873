// SPDX-License-Identifier: Apache-2.0
#include "experiments/montecarlo.h"
#include "robots/plant/plant.h"

#include <gtest/gtest.h>

#include <sstream>

namespace tandem::test {
namespace {

using namespace experiments;

struct Ark2024 : ::testing::Test {
  config::Robot robot = config::loadRobot(TANDEM_PRESETS "/robots/ark2024.yaml");
  RobotModel model{robot};
  LoopOptions options;
  MonteCarlo run{.seed = 7, .tasks = 20, .infeasible = 0.25, .methods = {}, .cases = {ErrorSizes{}}};

  Ark2024() {
    options.feedback = planning::Feedback::kSensor;
    for (int m = 0; m < control::kMethodCount; ++m)
      run.methods.push_back(static_cast<control::Method>(m));
  }
  std::vector<TaskResult> all(int from = 0, int step = 1) const {
    std::vector<TaskResult> results;
    for (std::size_t c = 0; c < run.cases.size(); ++c) {
      for (int i = from; i < run.tasks; i += step) {
        const auto more = runTask(robot, model, options, run, c, i);
        results.insert(results.end(), more.begin(), more.end());
      }
    }
    return results;
  }
  RandomTask task(int index, bool feasible, const LoopOptions& with) const {
    return randomTask(robot, model, with, 0.5, 3, index, feasible);
  }
};

std::string text(const std::vector<TaskResult>& results) {
  std::ostringstream out;
  writeResults(out, results);
  return out.str();
}

TEST_F(Ark2024, FeasibleTasksHaveAJointPathInsideAllLimits) {
  LoopOptions wrong = options;
  wrong.plant.model = "compliant";
  wrong.plant.tube_deviation = {0.05, 0.05, 0.05, 0.0};
  std::array<int, kPathKinds> kinds{};
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE("task " + std::to_string(i));
    const LoopOptions& plant = i % 2 == 0 ? options : wrong;
    const RandomTask t = task(i, true, plant);
    ++kinds[static_cast<std::size_t>(t.kind)];
    ASSERT_EQ(t.witness.size(), t.plan.points.size());
    ASSERT_EQ(t.plan.trajectory.point_count, static_cast<int>(t.witness.size()));
    sim::PlantTips tips = robots::makePlantTips(robot, plant.plant);
    Eigen::VectorXd before = model.stack(t.plan.start);
    // Elastic arms have hysteresis: from the start, in small steps.
    for (std::size_t k = 0; k < t.witness.size(); ++k) {
      for (int arm = 0; arm < 2; ++arm) {
        const Eigen::VectorXd q = t.witness[k].segment(6 * arm, 6), from = before.segment(6 * arm, 6);
        EXPECT_LE(safety::largestViolation(robot.arms[static_cast<std::size_t>(arm)].limits, q), 0.0);
        EXPECT_LE((q - from).head(3).cwiseAbs().maxCoeff(), 10.0 * 5e-3);
        EXPECT_LE((q - from).tail(3).cwiseAbs().maxCoeff(), 10.0 * 0.5);
        for (int s = 0; s <= 20; ++s)
          tips.update(arm, from + s / 20.0 * (q - from));
      }
      before = t.witness[k];
      const Eigen::Vector3d a = tips.pose(0).translation(), b = tips.pose(1).translation();
      EXPECT_LT((a - t.plan.points[k].tip).norm(), 1e-9);
      EXPECT_LT((a - b - t.plan.points[k].relative).norm(), 1e-9);
    }
    EXPECT_EQ(tips.snaps(0) + tips.snaps(1), 0u);
  }
  for (const int count : kinds)
    EXPECT_GT(count, 0);
}

/// Targets out of reach stretch the arms, where tasks become dependent and limits meet in corners.
TEST_F(Ark2024, HqpNeedsNoGateIntervention) {
  run = {.seed = 1, .tasks = 10000, .infeasible = 0.1, .methods = {control::Method::kHqp}, .cases = {ErrorSizes{}}};
  for (const int index : {999, 2769, 4169, 4189, 5309, 7269}) {
    SCOPED_TRACE("task " + std::to_string(index));
    const TaskResult result = runTask(robot, model, options, run, 0, index).front();
    EXPECT_GT(result.iterations, 500);
    EXPECT_EQ(result.gate_actions, 0u);
    EXPECT_EQ(result.violations, 0);
  }
}

TEST_F(Ark2024, TasksOutOfReachAreOutOfReach) {
  for (int i = 0; i < 20; ++i) {
    const RandomTask t = task(i, false, options);
    const Eigen::Vector3d entry = robot.arms[0].model.base.translation();
    EXPECT_TRUE(t.witness.empty());
    EXPECT_GT((t.plan.points.back().tip - entry).norm(), robot.arms[0].model.tubes[0].length());
  }
}

TEST_F(Ark2024, NoMethodLeavesItsLimitsOrClaimsWhatItHasNotDone) {
  run.cases = {ErrorSizes{}, ErrorSizes{.curvature = 0.05, .tip_noise = 1e-4, .encoder_counts = 1000, .play = 1e-5}};
  const auto results = all();
  ASSERT_EQ(results.size(), 2u * 20u * static_cast<std::size_t>(control::kMethodCount));
  for (const MethodSummary& row : summarise(results)) {
    SCOPED_TRACE(std::string(control::name(row.method)) + ", " + describe(row.errors));
    EXPECT_EQ(row.feasible, 15);
    EXPECT_EQ(row.infeasible, 5);
    EXPECT_EQ(row.violations, 0);
    EXPECT_EQ(row.reported, row.infeasible);
  }
  std::printf("%s", formatTable(summarise(results)).c_str());
}

TEST_F(Ark2024, ShardsMakeUpTheWholeRunToTheLastDigit) {
  run.methods = {control::Method::kNspqp, control::Method::kNsp};
  run.cases = {ErrorSizes{}, ErrorSizes{.curvature = 0.03, .tip_noise = 2e-4}};
  const std::string whole = text(all());
  std::vector<TaskResult> parts;
  for (const int shard : {2, 0, 1}) {
    std::istringstream file(text(all(shard, 3)));
    const auto more = readResults(file, "shard");
    parts.insert(parts.end(), more.begin(), more.end());
  }
  EXPECT_EQ(text(merge(parts)), whole);

  std::vector<TaskResult> missing(parts.begin() + 1, parts.end()), twice = parts, other = parts;
  twice.push_back(parts.front());
  other.back().seed += 1;
  for (const auto& wrong : {missing, twice, other})
    EXPECT_THROW(merge(wrong), std::invalid_argument);
}

TEST_F(Ark2024, BadFilesAreRefusedByPlace) {
  run.tasks = 1;
  run.methods = {control::Method::kNsp};
  const std::string good = text(all());
  const auto refusal = [](const std::string& file) -> std::string {
    std::istringstream in(file);
    try {
      readResults(in, "a.csv");
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal(good), "");
  EXPECT_NE(refusal("x,y\n1,2\n").find("a.csv:1: found 'x,y', expected the header"), std::string::npos);
  std::string method = good, number = good;
  method.replace(method.find(",nsp,"), 5, ",nps,");
  EXPECT_NE(refusal(method).find("a.csv:2: column 4: found 'nps', expected one of nsp, "), std::string::npos);
  number.replace(number.find("\n7,"), 3, "\n7x,");
  EXPECT_NE(refusal(number).find("a.csv:2: column 1: found '7x', expected a number"), std::string::npos);
  EXPECT_NE(refusal(good + "1,2\n").find("a.csv:3: found 2 columns"), std::string::npos);
}

}  // namespace
}  // namespace tandem::test
