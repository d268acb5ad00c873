// SPDX-License-Identifier: Apache-2.0
#include "operation/task_loop.h"

#include <gtest/gtest.h>

#include "operation/convert.h"
#include "operation/manual_control.h"
#include "tests/unit/operation/rig.h"

namespace tandem::test {
namespace {

using namespace operation;
using safety::OperatingState;

/** The task loop with tasks of arms at home. */
struct Loop : ::testing::Test {
  Rig rig;
  Drives drives{rig};
  DriveExchange exchange{rig.setup()};
  planning::Reference tasks;

  Loop() {
    exchange.take(drives.state);
    exchange.begin(kSecond);
    tasks.task_count = 1;
    tasks.tasks[0].kind = planning::TaskKind::kTipPosition;
  }
};

TEST_F(Loop, ASolverThatGivesNoAnswerIsAFaultOnceThatLasts) {
  TaskLoop loop(rig.setup(), exchange, rig.tracker(), nullptr);
  tasks.tasks[0].position[0] = 1e308;  // finite, but the resulting velocity is not
  const double allowed = rig.deployment.budgets.commandAge(rig.deployment.control_period);
  double lasted = 0.0;
  while (loop.follow(tasks, kSecond).faults == 0) {
    lasted += rig.deployment.control_period;
    EXPECT_TRUE(loop.result().solution.velocity.isZero(0.0));
    ASSERT_LE(lasted, allowed * (1.0 + 1e-9));
  }
  EXPECT_GT(lasted, allowed - 1.5 * rig.deployment.control_period);
}

TEST_F(Loop, HoldsWithoutMeasuredTipsAndSaysWhy) {
  rig.deployment.feedback = planning::Feedback::kSensor;
  TaskLoop loop(rig.setup(), exchange, rig.tracker(), nullptr);
  planning::teleoperation::TipPlaces tips;
  EXPECT_FALSE(loop.findTips(tips));
  loop.begin();
  EXPECT_EQ(loop.follow(tasks, kSecond).faults, 0u);
  EXPECT_EQ(loop.hold(), msg::HoldReason::kNoTips);
  EXPECT_TRUE(loop.result().solution.velocity.isZero(0.0));
  msg::ControlStatus status;
  loop.fill(status);
  EXPECT_EQ(static_cast<msg::HoldReason>(status.hold), msg::HoldReason::kNoTips);
}

/// A model's orientation would turn the tip as soon as an operator takes hold of it.
TEST_F(Loop, TipsThatAreHeldWhereTheyWereMeasuredDoNotMove) {
  rig.deployment.feedback = rig.deployment.orientation_feedback = planning::Feedback::kSensor;
  rig.deployment.clock = config::ClockMode::kLockStep;  // ages are simulated time
  TaskLoop loop(rig.setup(), exchange, rig.tracker(), nullptr);
  planning::teleoperation::TipPlaces places;
  msg::TipPoses measured;
  measured.arm_count = 2;
  measured.state_session = drives.state.session;
  measured.stamp = drives.state.stamp;
  const Eigen::Quaterniond turned[] = {Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Eigen::Vector3d(1, 2, 2) / 3)),
                                       Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(2, -1, 2) / 3))};
  const Eigen::Vector3d position[] = {{0.01, 0.0, 0.1}, {-0.01, 0.0, 0.1}};
  for (int k = 0; k < 2; ++k)
    msg::setTip(k, true, position[k], Eigen::Quaterniond(0, 0, 0, 0), measured);  // of a tracker without orientations
  loop.onTips(measured);
  EXPECT_FALSE(loop.findTips(places)) << "an orientation that tasks use was not measured";
  for (int k = 0; k < 2; ++k)
    msg::setTip(k, true, position[k], turned[k], measured);
  loop.onTips(measured);
  ASSERT_TRUE(loop.findTips(places));
  tasks.task_count = 2;
  for (int k = 0; k < 2; ++k) {
    planning::TaskReference& task = tasks.tasks[static_cast<std::size_t>(k)];
    task.kind = planning::TaskKind::kTipOrientation;
    task.arm = k;
    task.position = places[static_cast<std::size_t>(k)].position;
    task.orientation = places[static_cast<std::size_t>(k)].orientation;
  }
  loop.begin();
  EXPECT_EQ(loop.follow(tasks, kSecond).faults, 0u);
  ASSERT_EQ(loop.hold(), msg::HoldReason::kNone);
  EXPECT_LT(loop.result().solution.velocity.norm(), 1e-9);
}

TEST_F(Loop, AStreamOfATipEndsWithItsArmOrItsClient) {
  TaskLoop loop(rig.setup(), exchange, rig.tracker(), nullptr);
  safety::StateStamps statuses;
  RobotCondition condition;
  condition.arm_count = 2;
  for (ArmCondition& arm : condition.arm) {
    arm.wanted = arm.drives = OperatingState::kEnabled;
    arm.homed = true;
  }
  for (const bool silent : {true, false}) {
    ManualControl manual(rig.setup(), exchange);
    manual.locate(loop);
    ASSERT_TRUE(manual.tipsKnown());
    CrtkRequest request;
    request.verb = 5;  // servo_cv
    request.count = 3;
    CrtkOutcome outcome;
    ASSERT_TRUE(manual.onCrtk(request, kSecond, outcome)) << outcome.reason.data();
    CrtkEndings endings;
    const auto choose = [&](std::int64_t now, const RobotCondition& scene) {
      return manual.choose({now, msg::kCrtkClient, &statuses}, scene, loop.gains(), tasks, endings);
    };
    EXPECT_EQ(choose(kSecond, condition), msg::Source::kCrtk);
    EXPECT_TRUE(manual.active());
    RobotCondition later = condition;
    if (!silent)
      later.arm[0].drives = OperatingState::kPaused;
    EXPECT_EQ(choose(silent ? 2 * kSecond : kSecond, later), msg::Source::kNobody);
    EXPECT_FALSE(manual.active());
    EXPECT_EQ(endings.count, silent ? 1 : 0) << "an arm that is paused goes without saying";
  }
}

}  // namespace
}  // namespace tandem::test
