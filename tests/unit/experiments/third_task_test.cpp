// SPDX-License-Identifier: Apache-2.0
/** The rectangle of Table 3 with the axis or the orientation of tip A as third task: the first tenth of the preset's
 * path. */
#include <gtest/gtest.h>

#include <sstream>

#include "experiments/closed_loop.h"
#include "experiments/comparison.h"
#include "experiments/csv.h"

namespace tandem::test {
namespace {

struct ThirdTask : ::testing::Test {
  config::Experiment experiment = config::loadExperiment(TANDEM_PRESETS "/experiments/table3-axis.yaml");
  config::Robot robot = config::loadRobot(experiment.robot);
  robots::RobotModel model{robot};
  experiments::LoopOptions options =
      experiments::loopOptions(config::loadDeployment(TANDEM_PRESETS "/deployments/lockstep.yaml"), experiment);

  experiments::RunRecord run(experiments::RunPlan plan, bool third) {
    auto& shape = std::get<planning::Rectangle>(plan.trajectory.shape);
    shape.first *= 0.1;
    shape.second *= 0.1;
    plan.trajectory.point_count = 10;
    if (!third)
      plan.trajectory.further.clear();
    return experiments::runOffline(robot, model, plan, options);
  }
};

/// Mean angle between the axis of tip A and that at the start, over the iterations, rad.
double meanAngle(const experiments::RunRecord& record, const Eigen::Vector3d& start) {
  double sum = 0.0;
  for (const experiments::Row& row : record.rows()) {
    const Eigen::Vector3d axis = row.data.orientation[0].toRotationMatrix().col(2);
    sum += std::atan2(axis.cross(start).norm(), axis.dot(start));
  }
  return sum / static_cast<double>(record.rows().size());
}

TEST_F(ThirdTask, EveryMethodHoldsTheAxisAsFarAsTheFirstTwoTasksPermit) {
  for (const experiments::RunPlan& plan : experiments::plan(experiment)) {
    SCOPED_TRACE(plan.key.name());
    kinematics::Tip tip;
    ASSERT_EQ(model.models()[0]->tip(plan.start[0], tip), kinematics::ModelStatus::kOk);
    const Eigen::Vector3d start = tip.pose.linear().col(2);
    const experiments::RunRecord with = run(plan, true), without = run(plan, false);
    const experiments::RunSummary summary = with.summary();
    ASSERT_EQ(summary.further.size(), 1u);
    EXPECT_EQ(summary.failure, "");
    const double held = meanAngle(with, start), free = meanAngle(without, start);
    EXPECT_EQ(summary.converged, summary.points);
    EXPECT_EQ(summary.limit_violations, 0);
    EXPECT_LT(held, 0.8 * free);
    // sns scales a task as a whole: where a limit forbids a part of it, it follows less of it.
    const double most = plan.key.method == control::Method::kSns ? 7.0 : 3.0;
    EXPECT_LT(summary.further[0].errors.max, most * M_PI / 180.0);
    EXPECT_NE(experiments::formatFurther({{summary}}, robot).find(plan.key.name() + ": axis of a: mean "),
              std::string::npos);
    std::ostringstream rows;
    experiments::writeRun(rows, with, robot);
    EXPECT_NE(rows.str().find(",tip_x,tip_y,tip_z,err_axis_a\n"), std::string::npos);
  }
}

/// Mean angle of the rotation of tip A from that at the start, over the iterations, rad.
double meanTurn(const experiments::RunRecord& record, const Eigen::Matrix3d& start) {
  double sum = 0.0;
  for (const experiments::Row& row : record.rows())
    sum += Eigen::AngleAxisd(row.data.orientation[0].toRotationMatrix() * start.transpose()).angle();
  return sum / static_cast<double>(record.rows().size());
}

/// nsp and the two of weighted least norm have no limits of their own: see docs/tasks.md.
TEST_F(ThirdTask, MethodsWithLimitsHoldTheOrientation) {
  experiment = config::loadExperiment(TANDEM_PRESETS "/experiments/table3-orientation.yaml");
  double all_held = 0.0, all_free = 0.0;
  for (const experiments::RunPlan& plan : experiments::plan(experiment)) {
    using control::Method;
    if (plan.key.method == Method::kNsp || plan.key.method == Method::kNspwln ||
        plan.key.method == Method::kNspwlnJoint)
      continue;
    SCOPED_TRACE(plan.key.name());
    kinematics::Tip tip;
    ASSERT_EQ(model.models()[0]->tip(plan.start[0], tip), kinematics::ModelStatus::kOk);
    const experiments::RunRecord with = run(plan, true), without = run(plan, false);
    const experiments::RunSummary summary = with.summary();
    EXPECT_EQ(summary.failure, "");
    EXPECT_EQ(summary.converged, summary.points);
    EXPECT_EQ(summary.limit_violations, 0);
    const double held = meanTurn(with, tip.pose.linear()), free = meanTurn(without, tip.pose.linear());
    EXPECT_LT(held, free);
    all_held += held;
    all_free += free;
    ASSERT_EQ(summary.further.size(), 1u);
    EXPECT_NE(experiments::formatFurther({{summary}}, robot).find(plan.key.name() + ": orientation of a: mean "),
              std::string::npos);
  }
  EXPECT_LT(all_held, 0.5 * all_free);
}

}  // namespace
}  // namespace tandem::test
