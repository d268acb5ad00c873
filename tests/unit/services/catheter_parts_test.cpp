// SPDX-License-Identifier: Apache-2.0
/** @file Catheter-specific parts of the services. */
#include <gtest/gtest.h>

#include "catheter_system.h"
#include "operation/convert.h"
#include "robots/detail/path_run.h"
#include "robots/robot_type.h"
#include "services/control/mechanism_places.h"
#include "services/control/object_loop.h"
#include "services/planning/computation_request_handler.h"
#include "services/simulation/mechanism_tips.h"

namespace tandem::test {
namespace {

robots::Measured at(const safety::RobotVector& q) {
  robots::Measured now;
  now.joints = q;
  return now;
}

TEST(PathRun, FailsWithAReason) {
  const runtime::Setup setup = makeSetup("ablation-pair");
  safety::RobotVector home(6);
  home << setup.robot.arms[0].home, setup.robot.arms[1].home;
  planning::Reference reference;
  robots::PathRun run(setup.robot, setup.deployment.control_period);
  const auto begin = [&] {
    EXPECT_EQ(run.start(pathText("z"), at(home), {}), "");
    EXPECT_EQ(run.update(at(home), reference), "");
    EXPECT_EQ(run.progress().phase, planning::Phase::kRunning);
  };
  const auto fails_with = [&](const safety::RobotVector& q, const std::string& words) {
    const std::string why = run.update(at(q), reference);
    EXPECT_EQ(run.progress().phase, planning::Phase::kFailed);
    EXPECT_NE(why.find(words), std::string::npos) << why;
  };
  EXPECT_EQ(run.start(pathText("z"), {}, {}),
            "no valid actuation/state received yet; check that tandem-sim or tandem-hal is running");
  begin();
  safety::RobotVector apart = home;
  apart[0] += 5e-4;
  fails_with(apart, "contact residual is 0.");
  begin();
  safety::RobotVector away = home;
  away[0] += 2e-3;
  away[3] += 2e-3;
  fails_with(away, "path error is 2 mm, allowed 1 mm");
  begin();
  fails_with(safety::RobotVector::Constant(6, std::nan("")), "no equilibrium at the present joints: ");
  begin();
  fails_with(safety::RobotVector(), "the measured joints are not valid");
  begin();
  run.pause();
  ASSERT_EQ(run.update(at(home), reference), "");
  EXPECT_TRUE(reference.object.feed_forward.isZero(0.0));
  run.resume();
  ASSERT_EQ(run.update(at(home), reference), "");
  EXPECT_EQ(run.progress().iteration, 2);
}

TEST(EquilibriumFollower, ReachesDistantJointsInSteps) {
  const runtime::Setup setup = makeSetup("ablation-pair");
  robots::EquilibriumFollower jump = robots::makeEquilibriumFollower(setup.robot),
                              walk = robots::makeEquilibriumFollower(setup.robot);
  const safety::RobotVector home = jump.joints();
  safety::RobotVector far = home;
  far[0] += 0.02;
  far[3] += 0.02;
  ASSERT_EQ(jump.solveEquilibrium(far), "");
  for (int k = 1; k <= 200; ++k)
    ASSERT_EQ(walk.solveEquilibrium(home + k / 200.0 * (far - home)), "");
  EXPECT_LT((jump.mechanism().pose().translation() - walk.mechanism().pose().translation()).norm(), 1e-9);
  EXPECT_NE(jump.solveEquilibrium(safety::RobotVector::Zero(5)), "");
  EXPECT_EQ(jump.joints(), far) << "the last equilibrium stays";
}

TEST(ObjectLoop, HoldsWithoutAFreshEquilibrium) {
  const runtime::Setup setup = makeSetup("ablation-pair");
  const robots::RobotModel model(setup.robot);
  const auto tracker = control_service::ControlRequestHandler(setup, model).makeTracker();
  control_service::ObjectLoop loop(setup);
  safety::RobotVector home(6), still = safety::RobotVector::Zero(6);
  home << setup.robot.arms[0].home, setup.robot.arms[1].home;
  const auto mechanism = robots::typeOf(setup.robot).makeMechanism(setup.robot);
  ASSERT_EQ(mechanism->solveEquilibrium(home), "");
  planning::Reference tasks;
  tasks.task_count = 1;
  tasks.tasks[0].kind = planning::TaskKind::kObjectPose;
  tasks.object.position = mechanism->pose().translation() + Eigen::Vector3d(0.0, 0.0, 1e-4);
  tasks.object.orientation = Eigen::Quaterniond(mechanism->pose().linear());
  tasks.object.tracked[2] = true;
  planning::TrackResult result;
  std::int64_t now = 1'000'000'000;
  const auto step = [&] { return loop.step(now, home, still, tasks, *tracker, result); };
  EXPECT_EQ(step(), dds::HoldReason::kNoEquilibrium) << "none yet";
  EXPECT_EQ(result.status, planning::TrackStatus::kNoEquilibrium);
  EXPECT_TRUE(result.solution.velocity.isZero(0.0));
  loop.requestEquilibrium(now, home, still, *tracker);
  EXPECT_EQ(step(), dds::HoldReason::kNone);
  EXPECT_EQ(result.status, planning::TrackStatus::kOk);
  EXPECT_NEAR(result.error[0], 1e-4, 1e-9);
  EXPECT_GT(result.solution.velocity.norm(), 1e-5);
  now += 40'000'000;
  EXPECT_EQ(step(), dds::HoldReason::kNone) << "an older one will do";
  now += 400'000'000;
  EXPECT_EQ(step(), dds::HoldReason::kNoEquilibrium) << "too old";
  loop.requestEquilibrium(now, home, still, *tracker);
  EXPECT_EQ(step(), dds::HoldReason::kNone);
  loop.restart();
  EXPECT_EQ(step(), dds::HoldReason::kNoEquilibrium) << "of joints that have been put elsewhere";
  loop.requestEquilibrium(now, home, still, *tracker);
  EXPECT_EQ(step(), dds::HoldReason::kNone);
}

TEST(EquilibriumSolver, AnswersFromItsThread) {
  const runtime::Setup setup = makeSetup("ablation-pair");
  control_service::EquilibriumSolver equilibrium_solver(setup);
  equilibrium_solver.start();
  control_service::EquilibriumSolver::Request request;
  request.stamp = 5;
  request.joint_count = 6;
  Eigen::Vector3d::Map(request.joints.data()) = setup.robot.arms[0].home;
  Eigen::Vector3d::Map(request.joints.data() + 3) = setup.robot.arms[1].home;
  equilibrium_solver.submit(request);
  equilibrium_solver.stop();  // after the requested computation
  control_service::EquilibriumSolver::Result answer;
  ASSERT_TRUE(equilibrium_solver.take(answer));
  EXPECT_EQ(answer.stamp, 5);
  EXPECT_EQ(answer.equilibrium.joint_count, 6);
}

TEST(MechanismTips, LieInTheEquilibriumOfTheArms) {
  System system("ablation-pair");
  system.run(0.1);
  simulation::MechanismSnapshot snapshot;
  system.sim.plantJoints(snapshot);
  ASSERT_EQ(snapshot.joint_count, 6);
  const dds::TipPoses tips = simulation::MechanismTips(system.setup).at(snapshot);
  control_service::MechanismPlaces places(system.setup, system.model);
  ASSERT_TRUE(places.update(system.state));
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ(tips.valid[static_cast<std::size_t>(k)], 1);
    EXPECT_LT((dds::tipPosition(tips, k) - places.tip(k).translation()).norm(), 1e-12);
    const dds::Shape shape = places.shape(k);
    ASSERT_GT(shape.tubes.size(), 20u);
    const std::size_t last = shape.points.size() - 3;
    const Eigen::Vector3d end(shape.points[last], shape.points[last + 1], shape.points[last + 2]);
    EXPECT_LT((end - places.tip(k).translation()).norm(), 1e-6);
    EXPECT_NEAR(shape.outer_radius[0], 1.1665e-3, 1e-6);
  }
}

TEST(Catheters, PlanningServiceRefusesComputations) {
  const runtime::Setup setup = makeSetup("ablation-pair");
  std::vector<dds::Reply> replies;  // of the handler's only sending thread, which ends before they are read
  {
    planning_service::ComputationRequestHandler handler(
        setup, [&](const planning_service::ComputationRequestHandler::Outgoing& message) {
          replies.push_back(std::get<dds::Reply>(message));
        });
    dds::ComputationRequest request;
    request.client = 7;
    request.request = 3;
    request.kind = static_cast<std::uint8_t>(dds::ComputationKind::kCheck);
    handler.onRequest(request);
  }
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(replies[0].request, 3u);
  EXPECT_EQ(replies[0].accepted, 0);
  EXPECT_EQ(replies[0].reason.find("robot: found the catheters of "), 0u) << replies[0].reason;
}

TEST(Catheters, ObjectPoseTasksSurviveTheRoundTrip) {
  planning::Reference reference;
  reference.task_count = 1;
  reference.tasks[0].kind = planning::TaskKind::kObjectPose;
  reference.object.position = {0.1, 0.2, 0.3};
  reference.object.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY()));
  reference.object.feed_forward << 1, 2, 3, 4, 5, 6;
  reference.object.tracked = {true, false, true, false, false, true};
  dds::PlanningReference message;
  dds::setTasks(reference, message);
  const planning::ObjectReference back = dds::tasksOf(message).object;
  EXPECT_EQ(back.position, reference.object.position);
  EXPECT_EQ(back.orientation.coeffs(), reference.object.orientation.coeffs());
  EXPECT_EQ(back.tracked, reference.object.tracked);
  for (int k = 0; k < 6; ++k)
    EXPECT_EQ(back.feed_forward[k], back.tracked[static_cast<std::size_t>(k)] ? k + 1.0 : 0.0);
}

}  // namespace
}  // namespace tandem::test
