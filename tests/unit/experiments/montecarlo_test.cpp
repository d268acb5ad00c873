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
  MonteCarlo run{.seed = 7, .tasks = 20, .infeasible = 0.25, .methods = {}, .cases = {Conditions{}}};

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
      EXPECT_GE(tips.clearance(), 0.0);
    }
    EXPECT_EQ(tips.snaps(0) + tips.snaps(1), 0u);
  }
  for (const int count : kinds)
    EXPECT_GT(count, 0);
}

/// Targets out of reach stretch the arms, where tasks become dependent and limits meet in corners.
TEST_F(Ark2024, HqpNeedsNoGateIntervention) {
  run = {.seed = 1, .tasks = 10000, .infeasible = 0.1, .methods = {control::Method::kHqp}, .cases = {Conditions{}}};
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
  run.cases = {Conditions{},
               Conditions{.curvature = 0.05, .tip_noise = 1e-4, .encoder_counts = 1000, .backlash = 1e-5}};
  const auto results = all();
  ASSERT_EQ(results.size(), 2u * 20u * static_cast<std::size_t>(control::kMethodCount));
  for (const MethodSummary& row : summarise(results)) {
    SCOPED_TRACE(std::string(control::name(row.method)) + ", " + describe(row.conditions));
    EXPECT_EQ(row.feasible, 15);
    EXPECT_EQ(row.infeasible, 5);
    EXPECT_EQ(row.violations, 0);
    EXPECT_EQ(row.reported, row.infeasible);
  }
  std::printf("%s", formatTable(summarise(results), pairMethods(results)).c_str());
}

TaskResult runOf(const Ark2024& test, const Conditions& conditions, int task = 2) {
  MonteCarlo run = test.run;
  run.infeasible = 0.0;
  run.methods = {control::Method::kNspqp};
  run.cases = {conditions};
  return runTask(test.robot, test.model, test.options, run, 0, task).front();
}

TEST_F(Ark2024, ToleranceOfTheRunInsideTheThresholdLowersTheErrors) {
  const TaskResult at_threshold = runOf(*this, {}), same = runOf(*this, {.stop_within = 0.88e-3});
  EXPECT_EQ(at_threshold.a.rms, same.a.rms);
  EXPECT_EQ(at_threshold.iterations, same.iterations);
  const TaskResult inside = runOf(*this, {.stop_within = 0.1e-3});
  EXPECT_TRUE(inside.succeeded());
  EXPECT_LE(inside.a.max, 0.1e-3);
  EXPECT_LE(inside.ab.max, 0.1e-3);
  EXPECT_GT(at_threshold.a.rms, 0.4e-3);
  EXPECT_GT(inside.iterations, at_threshold.iterations);
}

TEST_F(Ark2024, TimedTrackingFollowsSlowReferencesAndComesToRestAtTheEnd) {
  const TaskResult slow = runOf(*this, {.speed = 0.5e-3}), fast = runOf(*this, {.speed = 20e-3});
  EXPECT_EQ(slow.outcome, Outcome::kCompleted);
  EXPECT_TRUE(slow.succeeded());
  EXPECT_LT(slow.a.rms, 0.05e-3);
  EXPECT_LT(slow.ab.max, 0.1e-3);
  EXPECT_LT(slow.steady_a, 1e-6);
  EXPECT_LT(slow.steady_ab, 1e-6);
  // Joints at their bounds cannot follow.
  EXPECT_GT(fast.a.max, slow.a.max);
  EXPECT_GT(slow.points, fast.points);
  MonteCarlo far = run;
  far.infeasible = 1.0;
  far.methods = {control::Method::kHqp};
  far.cases = {{.speed = 2e-3}};
  EXPECT_EQ(runTask(robot, model, options, far, 0, 0).front().outcome, Outcome::kNotConverged);
}

TEST(TaskResults, SnapsAndContactsAreNoSuccess) {
  TaskResult result;
  result.outcome = Outcome::kCompleted;
  result.points = result.converged = 3;
  EXPECT_TRUE(result.succeeded());
  result.snaps = 1;
  EXPECT_FALSE(result.succeeded());
  result.snaps = 0, result.contacts = 2;
  EXPECT_FALSE(result.succeeded());
  const MethodSummary row = summarise({result, result}).front();
  EXPECT_EQ(row.contacts, 2);
  EXPECT_EQ(row.succeeded, 0);
}

/// Expected: the formula and sums of binomial coefficients, computed in Python.
/// The printed curvatures are ten times too large: such tubes have no equilibrium everywhere.
TEST(TaskResults, ARefusalNamesItsReason) {
  const config::Robot robot = config::loadRobot(TANDEM_PRESETS "/robots/ark2024-as-printed.yaml");
  const RobotModel model(robot, "compliant");
  LoopOptions options;
  options.plant.model = "compliant";
  const MonteCarlo run{.seed = 3, .tasks = 20, .infeasible = 0.5, .methods = {control::Method::kNspqp}, .cases = {{}}};
  const std::string reason = "arm_a: the simulated arm has no solution at these joints: no equilibrium was found";
  std::vector<TaskResult> results = runTask(robot, model, options, run, 0, 7);
  ASSERT_EQ(results.front().outcome, Outcome::kRefused);
  EXPECT_EQ(results.front().reason, reason);
  EXPECT_EQ(summarise(results).front().refusals, (std::map<std::string, int>{{reason, 1}}));
  EXPECT_NE(formatTable(summarise(results), {}).find("nspqp: 1 refused: " + reason + "\n"), std::string::npos);
  std::istringstream written(text(results));
  EXPECT_EQ(readResults(written, "file").front().reason, reason);
}

TEST(Proportions, HaveTheirIntervalsAndPairedTests) {
  EXPECT_NEAR(wilson(0, 10).upper, 0.277533, 1e-6);
  EXPECT_EQ(wilson(0, 10).lower, 0.0);
  EXPECT_NEAR(wilson(5, 10).lower, 0.236593, 1e-6);
  EXPECT_NEAR(wilson(5, 10).upper, 0.763407, 1e-6);
  EXPECT_EQ(wilson(10, 10).upper, 1.0);
  EXPECT_EQ(wilson(0, 0).upper, 1.0);
  EXPECT_EQ(mcnemar(0, 0), 1.0);
  EXPECT_NEAR(mcnemar(0, 2), 0.5, 1e-12);
  EXPECT_NEAR(mcnemar(2, 8), 0.109375, 1e-12);
  EXPECT_NEAR(mcnemar(500, 500), 1.0, 1e-12);
}

TEST(Proportions, MethodsAreComparedTaskByTask) {
  std::vector<TaskResult> results;
  const auto add = [&](int task, control::Method method, bool succeeds, bool feasible = true) {
    TaskResult r;
    r.task = task;
    r.method = method;
    r.feasible = feasible;
    r.outcome = succeeds ? Outcome::kCompleted : Outcome::kNotConverged;
    results.push_back(r);
  };
  for (int task = 0; task < 5; ++task) {
    add(task, control::Method::kNspqp, task != 1, task != 4);
    add(task, control::Method::kHqp, task != 2 && task != 3, task != 4);
  }
  const std::vector<MethodPair> pairs = pairMethods(results);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].method, control::Method::kHqp);
  EXPECT_EQ(pairs[0].method_alone, 1);
  EXPECT_EQ(pairs[0].other_alone, 2);
  EXPECT_NE(
      formatTable(summarise(results), pairs).find("hqp against nspqp, tasks that one alone completed: 1 : 2, p = 1\n"),
      std::string::npos);
}

TEST_F(Ark2024, ShardsMakeUpTheWholeRunToTheLastDigit) {
  run.methods = {control::Method::kNspqp, control::Method::kNsp};
  run.cases = {Conditions{}, Conditions{.curvature = 0.03, .tip_noise = 2e-4}};
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
  // Files of earlier versions lack the last columns, and counted a snap as no failure.
  std::vector<TaskResult> results = all();
  results.front().snaps = 1;
  results.front().outcome = Outcome::kCompleted;
  results.front().converged = results.front().points;
  std::string old;
  std::istringstream lines(text(results));
  for (std::string line; std::getline(lines, line);) {
    for (int cut = 0; cut < 10; ++cut)
      line.resize(line.rfind(','));
    old += line + "\n";
  }
  EXPECT_NE(refusal(old).find("found '0', expected a value that agrees"), std::string::npos);
  old.replace(old.size() - 2, 1, "1");
  EXPECT_EQ(refusal(old), "");
}

}  // namespace
}  // namespace tandem::test
