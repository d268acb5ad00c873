// SPDX-License-Identifier: Apache-2.0
#include "experiments/closed_loop.h"

#include <gtest/gtest.h>

#include <sstream>

#include "config/robot_files.h"
#include "experiments/comparison.h"
#include "experiments/csv.h"

namespace tandem::test {
namespace {

struct Table3 : ::testing::Test {
  config::Experiment experiment = config::loadExperiment(TANDEM_PRESETS "/experiments/table3.yaml");
  config::Robot robot = config::loadRobot(experiment.robot);
  robots::RobotModel model{robot};
  experiments::LoopOptions options = of("lockstep");

  experiments::LoopOptions of(const std::string& deployment) {
    const std::string file = std::string(TANDEM_PRESETS) + "/deployments/" + deployment + ".yaml";
    return experiments::loopOptions(config::loadDeployment(file), experiment);
  }
  experiments::RunPlan plan(const std::string& name) {
    for (const experiments::RunPlan& plan : experiments::plan(experiment)) {
      if (plan.key.name() == name)
        return plan;
    }
    throw std::invalid_argument(name);
  }
  experiments::RunRecord run(const experiments::RunPlan& plan) {
    return experiments::runOffline(robot, model, plan, options);
  }
};

TEST_F(Table3, ReproducesThePublishedSignature) {
  std::vector<experiments::RunSummary> summaries;
  for (const auto& plan : experiments::plan(experiment))
    summaries.push_back(run(plan).summary());
  ASSERT_EQ(summaries.size(), 24u);
  const auto rows = experiments::compare(summaries, experiment.published);
  ASSERT_EQ(rows.size(), 8u);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto& row = rows[i];
    EXPECT_EQ(row.converged, row.points) << i;
    EXPECT_EQ(row.limit_violations, 0) << i;
    EXPECT_LE(row.a.max, 0.88e-3) << i;
    EXPECT_LE(row.ab.max, row.method == control::Method::kNspwln ? 0.35e-3 : 0.13e-3) << i;
    EXPECT_EQ(row.published == nullptr, row.method == control::Method::kNspwlnJoint);
  }
  for (std::size_t first : {0u, 4u}) {  // nspwln, nspwln-joint, nspqp, snsqp
    EXPECT_NEAR(rows[first].iterations / rows[first + 2].iterations, 2.0, 0.2);
    EXPECT_NEAR(rows[first + 1].iterations / rows[first + 2].iterations, 1.0, 0.05);
  }
}

TEST_F(Table3, SameDigitsEveryTime) {
  for (const auto& plan : experiments::plan(experiment)) {
    if (plan.key.name() != "lissajous-1-nspwln")
      continue;
    std::ostringstream first, second;
    experiments::writeRun(first, run(plan), robot);
    experiments::writeRun(second, run(plan), robot);
    EXPECT_EQ(first.str(), second.str());
    EXPECT_NE(first.str().find("point,iteration,beta_a1,beta_a2,beta_a3,alpha_a1,alpha_a2,alpha_a3,beta_b1,"),
              std::string::npos);
  }
}

// Regression: with models and enabling that treated readings as exact, 10 nm ended every run at a limit.
TEST_F(Table3, NoiseOfEncodersEndsNoRun) {
  for (const double noise : {1e-8, 1e-6, 1e-5, 1e-4}) {
    options.plant.encoders.noise = {noise, 0.0};
    config::setReadingErrors(options.plant.encoders, robot);
    const robots::RobotModel noisy(robot);
    for (const auto& plan : experiments::plan(experiment)) {
      const experiments::RunSummary summary = experiments::runOffline(robot, noisy, plan, options).summary();
      EXPECT_EQ(summary.failure, "") << plan.key.name() << " at " << noise;
      EXPECT_EQ(summary.limit_violations, 0) << plan.key.name() << " at " << noise;
      if (noise <= 1e-5) {
        EXPECT_GE(summary.converged, 0.9 * summary.points) << plan.key.name() << " at " << noise;
      }
    }
  }
}

TEST_F(Table3, ARunThatFailsSaysWhyAndKeepsItsRows) {
  // The fixture's model has no tolerance: a reading at a limit is outside equation (1).
  options.plant.encoders.noise = {1e-6, 0.0};
  const experiments::RunSummary summary = run(plan("rectangle-1-nspqp")).summary();
  EXPECT_NE(summary.failure, "");
  EXPECT_LT(summary.converged, summary.points);
  EXPECT_NE(experiments::formatFailures({{summary}}).find("rectangle-1-nspqp ended after"), std::string::npos);
}

TEST_F(Table3, WithoutGateOnlyMethodsWithoutLimitsLeaveThem) {
  config::Robot controlled = robot;
  const config::Robot free = experiments::withoutGate(controlled);
  const robots::RobotModel tolerant(controlled);
  for (const auto& plan : experiments::plan(experiment)) {
    const auto gated = run(plan);
    const auto record = experiments::runOffline(free, tolerant, plan, options);
    const experiments::RunSummary summary = record.summary();
    SCOPED_TRACE(plan.key.name());
    EXPECT_EQ(summary.failure, "");
    EXPECT_EQ(summary.gate_actions, 0u);
    EXPECT_EQ(gated.summary().largest_excess, 0.0);
    EXPECT_EQ(summary.limit_violations > 0, summary.largest_excess > 0.0);
    if (gated.summary().gate_actions > 0)
      continue;
    // Where the gate has nothing to do, its absence changes no digit.
    std::ostringstream with, without;
    experiments::writeRun(with, gated, robot);
    experiments::writeRun(without, record, robot);
    EXPECT_EQ(with.str(), without.str());
    EXPECT_EQ(summary.largest_excess, 0.0);
  }
}

TEST_F(Table3, RelativePositionCanMoveAlong) {
  auto plan = experiments::plan(experiment).front();
  plan.key.method = control::Method::kSnsqp;
  plan.trajectory.relative = {planning::Line{{0.0, -0.005, 0.0}}};
  const auto record = run(plan);
  EXPECT_EQ(record.summary().converged, 100);
  const auto& first = record.rows().front().data.reference.tasks[0].position;
  const auto& last = record.rows().back().data.reference.tasks[0].position;
  EXPECT_NEAR((last - first).norm(), 0.005, 0.0001);
}

TEST(Csv, NumbersReadBackToTheSameValue) {
  for (const double value : {0.1, -1e-300, 3.0, 1.0 / 3.0, 12345678.9}) {
    EXPECT_EQ(std::stod(experiments::number(value)), value);
  }
  EXPECT_EQ(experiments::number(std::nan("")), "");
}

TEST(Csv, BadRowsHaveAReason) {
  std::istringstream in("1,2\n1,x\n1\n\n1,nan\r\n 3 ,\t4\n");
  const auto rows = experiments::readRows(in, 2);
  ASSERT_EQ(rows.size(), 6u);
  EXPECT_TRUE(rows[0].error.empty());
  EXPECT_EQ(rows[1].error, "line 2 column 2: found 'x', expected a number");
  EXPECT_EQ(rows[2].error, "line 3: found 1 numbers, expected 2");
  EXPECT_FALSE(rows[3].error.empty());
  EXPECT_EQ(rows[4].error, "line 5 column 2: found 'nan', expected a finite number");
  EXPECT_TRUE(rows[5].error.empty());
  EXPECT_EQ(rows[5].values[1], 4.0);
}

}  // namespace
}  // namespace tandem::test
