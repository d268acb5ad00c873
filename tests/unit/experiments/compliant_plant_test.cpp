// SPDX-License-Identifier: Apache-2.0
/** @file Plant and controller with different models, and its correction by a tip tracker. */
#include <gtest/gtest.h>

#include <sstream>

#include "experiments/closed_loop.h"
#include "experiments/csv.h"

namespace tandem::test {
namespace {

struct CompliantPlant : ::testing::Test {
  config::Experiment experiment = config::loadExperiment(TANDEM_PRESETS "/experiments/table3.yaml");
  config::Robot robot = config::loadRobot(experiment.robot);
  robots::RobotModel rigid{robot}, compliant{robot, "compliant"};

  void useOverlap() { experiment = config::loadExperiment(TANDEM_PRESETS "/experiments/overlap.yaml"); }
  experiments::LoopOptions of(const std::string& deployment) const {
    const std::string file = std::string(TANDEM_PRESETS) + "/deployments/" + deployment + ".yaml";
    return experiments::loopOptions(config::loadDeployment(file), experiment);
  }
  experiments::RunPlan plan(const std::string& name) const {
    for (const experiments::RunPlan& plan : experiments::plan(experiment)) {
      if (plan.key.name() == name)
        return plan;
    }
    throw std::invalid_argument(name);
  }
  experiments::RunSummary run(const std::string& name,
                              const experiments::LoopOptions& options,
                              const robots::RobotModel& model) const {
    return experiments::runOffline(robot, model, plan(name), options).summary();
  }
};

TEST_F(CompliantPlant, MeasuredTipsCorrectTheErrorOfTheRigidModel) {
  // The only run of Table 3 in which curved parts begin to overlap at an angle.
  const auto off = run("rectangle-3-nspqp", of("lockstep-compliant-plant"), rigid);
  EXPECT_LE(off.converged, 60);
  EXPECT_GT(off.a.max, 2.5e-3);
  EXPECT_LT(off.iterations, 300) << "it takes itself to be there";
  const auto mended = run("rectangle-3-nspqp", of("lockstep-compliant-sensor"), rigid);
  EXPECT_EQ(mended.converged, mended.points);
  EXPECT_LE(mended.a.max, 0.88e-3);
  EXPECT_LE(mended.ab.max, 0.88e-3);
}

TEST_F(CompliantPlant, RigidModelMissesEveryPointWhereTubesOverlap) {
  useOverlap();
  for (const char* name : {"rectangle-2-nspqp", "lissajous-1-nspqp", "lissajous-2-snsqp"}) {
    const auto off = run(name, of("lockstep-compliant-plant"), rigid);
    EXPECT_EQ(off.converged, 0) << name;
    EXPECT_GT(off.a.rms, 1.5e-3) << name;
    const auto mended = run(name, of("lockstep-compliant-sensor"), rigid);
    EXPECT_EQ(mended.converged, mended.points) << name;
    const auto known = run(name, of("lockstep-compliant-plant"), compliant);
    EXPECT_EQ(known.converged, known.points) << name << ": with the plant's own model there is nothing to mend";
    EXPECT_LT(known.ab.max, 0.5 * mended.ab.max) << name << ": and its Jacobian is the right one";
  }
}

TEST_F(CompliantPlant, SameDigitsEveryTimeWithNoiseLagPlayAndDelay) {
  experiments::LoopOptions options = of("lockstep-compliant-sensor");
  options.plant.tracker.position_noise = 0.05e-3;
  options.plant.tracker.drop_out = 0.1;
  options.plant.mechanics = {0.03, {0.05, 0.02}, {20e-6, 2e-3}};
  options.plant.encoders = {{1e-6, 1e-4}, {2e-6, 1e-4}};
  options.plant.tube_deviation = {0.03, 0.03, 0.03, 0.0};
  const auto rows = [&](std::uint64_t seed) {
    options.plant.seed = seed;
    std::ostringstream out;
    experiments::writeRun(out, experiments::runOffline(robot, rigid, plan("rectangle-2-nspqp"), options), robot);
    return out.str();
  };
  const std::string first = rows(5);
  EXPECT_EQ(first, rows(5));
  EXPECT_NE(first, rows(6));
}

TEST_F(CompliantPlant, AnImperfectRobotConvergesWithTheSensor) {
  experiments::LoopOptions options = of("lockstep-compliant-sensor");
  options.plant.tracker.position_noise = 0.02e-3;
  options.plant.mechanics = {0.02, {0.03, 0.03}, {50e-6, 5e-3}};
  options.plant.tube_deviation = {0.05, 0.05, 0.05, 0.0};
  options.plant.tip_forces = {{0, {0.02, 0.0, 0.0}}};
  const auto summary = run("rectangle-2-nspqp", options, rigid);
  // A point is reached when the measured error is within the tolerance; the true error may differ by the noise.
  EXPECT_LE(summary.a.max, 0.88e-3 + 5 * 0.02e-3);
  EXPECT_LE(summary.ab.max, 0.88e-3 + 5 * 0.02e-3);
}

TEST_F(CompliantPlant, TooManyDropOutsHoldTheArms) {
  experiments::LoopOptions options = of("lockstep-compliant-sensor");
  options.plant.tracker.drop_out = 1.0;
  const auto record = experiments::runOffline(robot, rigid, plan("rectangle-2-nspqp"), options);
  // The measurement at the start is used for three periods; after that nothing moves.
  const auto& rows = record.rows();
  ASSERT_GT(rows.size(), 100u);
  EXPECT_NE(rows[0].data.position, rows[1].data.position);
  for (std::size_t i = 5; i < 100; ++i)
    ASSERT_EQ(rows[i].data.position, rows[4].data.position) << i;
  EXPECT_EQ(rows[50].data.scale[0], 0.0);
}

TEST_F(CompliantPlant, MeasuredOrientationsCorrectTheErrorOfTheModel) {
  useOverlap();
  experiments::RunPlan kept = plan("rectangle-2-nspqp");
  planning::FurtherTask axis;  // before the others, so that it can be reached
  constexpr double kDegree = 0.0174533;
  axis.kind = planning::TaskKind::kTipAxis;
  axis.tolerance = 0.2 * kDegree;
  kept.trajectory.further.push_back(axis);
  experiments::LoopOptions options = of("lockstep-compliant-sensor");
  const auto error = [&] {
    const auto summary = experiments::runOffline(robot, rigid, kept, options).summary();
    EXPECT_EQ(summary.failure, "");
    return summary.further.at(0).errors;
  };
  EXPECT_GT(error().rms, 4.0 * kDegree) << "the rigid model is off, and its axis is where it should be";
  options.orientation_feedback = planning::Feedback::kSensor;
  EXPECT_LT(error().rms, 0.25 * kDegree);
  options.plant.tracker.rotation_noise = 0.05 * kDegree;
  EXPECT_LT(error().rms, 0.4 * kDegree);
  options.plant.tracker.rotation_noise = 0.0;
  options.plant.tracker.rotation_bias = {2.0 * kDegree, 0.0, 0.0};
  const double biased = error().rms;
  EXPECT_GT(biased, 1.0 * kDegree) << "what the tracker does not see, nobody corrects";
  EXPECT_LT(biased, 2.2 * kDegree);
}

TEST_F(CompliantPlant, ATrackerWithoutOrientationsHoldsTheArmsWhoseTasksNeedThem) {
  experiments::LoopOptions options = of("lockstep-compliant-sensor");
  options.orientation_feedback = planning::Feedback::kSensor;
  options.plant.tracker.orientations = false;
  EXPECT_EQ(run("rectangle-2-nspqp", options, rigid).converged, 100) << "positions need none";
  experiments::RunPlan kept = plan("rectangle-2-nspqp");
  planning::FurtherTask axis;
  axis.kind = planning::TaskKind::kTipAxis;
  kept.trajectory.further.push_back(axis);
  const auto record = experiments::runOffline(robot, rigid, kept, options);
  ASSERT_GT(record.rows().size(), 10u);
  EXPECT_EQ(record.rows().front().data.position, record.rows().back().data.position);
}

TEST_F(CompliantPlant, FeedbackWithoutATrackerIsRefused) {
  experiments::LoopOptions options = of("lockstep-compliant-sensor");
  options.plant.tracker.present = false;
  EXPECT_THROW(experiments::runOffline(robot, rigid, plan("rectangle-2-nspqp"), options), std::invalid_argument);
  options.feedback = planning::Feedback::kModel;
  options.orientation_feedback = planning::Feedback::kSensor;
  EXPECT_THROW(experiments::runOffline(robot, rigid, plan("rectangle-2-nspqp"), options), std::invalid_argument);
}

}  // namespace
}  // namespace tandem::test
