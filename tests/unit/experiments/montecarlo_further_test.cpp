// SPDX-License-Identifier: Apache-2.0
/** Random tasks with a further task of each kind. */
#include <gtest/gtest.h>

#include <sstream>

#include "experiments/montecarlo.h"

namespace tandem::test {
namespace {

using namespace experiments;
using planning::TaskKind;

constexpr std::array kKinds{TaskKind::kTipAxis,     TaskKind::kTipOrientation, TaskKind::kRelativeOrientation,
                            TaskKind::kLookAt,      TaskKind::kRemoteCentre,   TaskKind::kTipPose,
                            TaskKind::kRelativePose};

struct MonteCarloFurther : ::testing::Test {
  config::Robot robot = config::loadRobot(TANDEM_PRESETS "/robots/ark2024.yaml");
  RobotModel model{robot};
  LoopOptions options;

  std::vector<TaskResult> run(TaskKind kind, control::Method method, double infeasible, int tasks) const {
    const MonteCarlo run{.seed = 5,
                         .tasks = tasks,
                         .infeasible = infeasible,
                         .methods = {method},
                         .further = kind,
                         .cases = {Conditions{}}};
    std::vector<TaskResult> results;
    for (int i = 0; i < tasks; ++i)
      results.push_back(runTask(robot, model, options, run, 0, i).front());
    return results;
  }
};

/// At the joints of the path that shows a task to be feasible, the tips are at all of its places.
TEST_F(MonteCarloFurther, WitnessesDoTheFurtherTask) {
  for (const TaskKind kind : kKinds) {
    SCOPED_TRACE(std::string(kinematics::findTaskKind(kind)->name));
    for (int i = 0; i < 4; ++i) {
      const RandomTask task = randomTask(robot, model, options, 0.5, 9, i, true, kind);
      const planning::TrajectorySpec& spec = task.plan.trajectory;
      ASSERT_EQ(spec.further.size(), 1u);
      EXPECT_EQ(spec.tip_task, kind != TaskKind::kTipPose);
      EXPECT_EQ(spec.hasRelative(), kind != TaskKind::kRelativePose);
      planning::TipFollower tips(model.models());
      for (std::size_t k = 0; k < task.witness.size(); ++k) {
        ASSERT_TRUE(tips.update(task.witness[k]));
        const planning::Reference wanted = planning::referenceTo(spec, task.plan.points[k]);
        ASSERT_EQ(wanted.task_count, spec.taskCount());
        for (int t = 0; t < wanted.task_count; ++t) {
          const planning::TaskReference& to = wanted.tasks[static_cast<std::size_t>(t)];
          EXPECT_LT(kinematics::findTaskKind(to.kind)->error(planning::placeOf(to, tips, nullptr), to.place()), 1e-7);
        }
      }
    }
  }
}

TEST_F(MonteCarloFurther, MethodsReachMostFeasibleTasksAndReportTheOthers) {
  for (const TaskKind kind : kKinds) {
    const kinematics::TaskKindEntry& entry = *kinematics::findTaskKind(kind);
    SCOPED_TRACE(std::string(entry.name));
    const std::vector<TaskResult> results = run(kind, control::Method::kHqp, 0.25, 8);
    const MethodSummary row = summarise(results).front();
    EXPECT_EQ(row.feasible, 6);
    EXPECT_GE(row.succeeded, 3);
    EXPECT_EQ(row.reported, row.infeasible);
    EXPECT_EQ(row.violations, 0);
    for (const TaskResult& result : results) {
      EXPECT_GT(result.further_error.max, 0.0);
      if (result.succeeded()) {
        EXPECT_LE(result.further_error.max, 0.88e-3 / entry.length() * (1.0 + 1e-9)) << "a point needs this, too";
      }
    }
    EXPECT_NE(formatTable(summarise(results), {}).find("hqp: error of " + std::string(entry.name) + ", RMS"),
              std::string::npos);
    std::ostringstream written;
    writeResults(written, results);
    std::istringstream again(written.str());
    const std::vector<TaskResult> read = readResults(again, "file");
    ASSERT_EQ(read.size(), results.size());
    EXPECT_EQ(read[3].further, kind);
    EXPECT_EQ(read[3].further_error.rms, results[3].further_error.rms);
  }
}

/// The paths keep the distance of a soft task, and most methods find a way that does.
TEST_F(MonteCarloFurther, SoftTasksAreFeasibleAndMostlyDone) {
  const RobotModel elastic{robot, "compliant"};
  LoopOptions snapping = options;
  snapping.plant.model = "compliant";
  for (const TaskKind kind : {TaskKind::kJointLimits, TaskKind::kElasticStability}) {
    SCOPED_TRACE(std::string(kinematics::findTaskKind(kind)->name));
    const bool joints = kind == TaskKind::kJointLimits;
    const RobotModel& own = joints ? model : elastic;
    const LoopOptions& loop = joints ? options : snapping;
    for (int i = 0; i < 3; ++i) {
      const RandomTask task = randomTask(robot, own, loop, 0.5, 9, i, true, kind);
      ASSERT_EQ(task.plan.trajectory.further.size(), 1u);
      EXPECT_EQ(task.plan.trajectory.further[0].target.x(), joints ? kKeptDistance : kKeptStability);
      planning::TipFollower tips(own.models(), own.limits());
      for (const safety::RobotVector& q : task.witness) {
        ASSERT_TRUE(tips.update(q));
        const auto at =
            tips.avoidance(0, kinematics::findTaskKind(kind)->point, joints ? kKeptDistance : kKeptStability);
        EXPECT_LT(at.cost, 1e-6);
      }
    }
    const MonteCarlo run{.seed = 5,
                         .tasks = 6,
                         .infeasible = 0.0,
                         .methods = {control::Method::kHqp},
                         .further = kind,
                         .cases = {Conditions{}}};
    std::vector<TaskResult> results;
    for (int i = 0; i < run.tasks; ++i)
      results.push_back(runTask(robot, own, loop, run, 0, i).front());
    EXPECT_GE(summarise(results).front().succeeded, 3);
    EXPECT_NE(formatTable(summarise(results), {}).find(joints ? " mm" : " stability"), std::string::npos);
  }
}

TEST_F(MonteCarloFurther, RunsOfDifferentKindsAreNotMerged) {
  std::vector<TaskResult> results = run(TaskKind::kTipAxis, control::Method::kNspqp, 0.0, 2);
  EXPECT_EQ(merge(results).size(), 2u);
  results[1].further = TaskKind::kLookAt;
  EXPECT_THROW(merge(results), std::invalid_argument);
}

}  // namespace
}  // namespace tandem::test
