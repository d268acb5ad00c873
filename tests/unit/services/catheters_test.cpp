// SPDX-License-Identifier: Apache-2.0
/** @file Catheters through simulator, control and planning, without DDS. */
#include <gtest/gtest.h>

#include "config/path.h"
#include "experiments/catheters.h"
#include "experiments/track.h"
#include "services/control/catheter_places.h"
#include "services/dds/convert.h"
#include "services/sim/catheter_tips.h"
#include "system.h"

namespace tandem::test {
namespace {

using safety::OperatingState;
using safety::StateCommand;

std::string pathText(const std::string& along, const std::string& more = "") {
  return "tandem: path/1\nname: test\nshape: line\nalong: [" + along + "]\nsize_mm: 0.5\nduration_s: 1\nhold: none\n" +
         more;
}

void inStep(config::Deployment& deployment) { deployment.clock = config::ClockMode::kLockStep; }

/** The same services in lock-step. */
struct Stepped : System {
  explicit Stepped(const std::string& deployment) : System(deployment, inStep) {
    sim.state(0, state);
    control.onState(state);
    planning.onState(state);
    tell();
    order(dds::ControlKind::kAcquireLease);
    command(StateCommand::kEnable);
    tell();
    sim.onCommand(output.command, 0);
    hear();
    tell();
  }
  /// Control's status, without a step.
  void tell() {
    control.cycle(now, false, output);
    planning.onStatus(output.status);
  }
  void hear() {
    sim.state(0, state);
    control.onState(state);
    planning.onState(state);
  }
  /// Steps as long as planning asks for them. @return joints before each
  std::vector<safety::RobotVector> walk() {
    std::vector<safety::RobotVector> all;
    for (auto reference = planning.take(); reference; reference = planning.take()) {
      reference_message = *reference;
      control.onReference(*reference);
      if (!control.readyToAdvance())
        break;
      safety::RobotVector q;
      dds::measuredJoints(state, model.armCount(), model.jointCount(), q);
      all.push_back(q);
      control.cycle(now, true, output);
      planning.onStatus(output.status);
      sim.onCommand(output.command, 0);
      hear();
    }
    return all;
  }
  planning::Phase phase() const { return static_cast<planning::Phase>(reference_message.phase); }
};

/// In lock-step the services do what one process does, to the last joints.
void expectSameAsInOneProcess(const std::string& preset, const std::string& text) {
  Stepped system(preset);
  const auto mechanism = service::makeMechanism(system.setup.robot);
  planning::ObjectPath path = config::parsePath(text, "test");
  path.length = mechanism->length();
  experiments::TrackOptions options;
  options.parameters = system.setup.robot.parameters;
  options.parameters.period = system.setup.deployment.control_period;
  options.gain = 5.0;
  const experiments::TrackRecord record = experiments::track(*mechanism, path, options);
  ASSERT_TRUE(record.good()) << record.refused << record.stopped;
  const dds::Reply reply = system.startText(text);
  ASSERT_EQ(reply.accepted, 1) << reply.reason;
  const auto joints = system.walk();
  EXPECT_EQ(system.phase(), planning::Phase::kFinished) << system.planning.ended();
  ASSERT_EQ(joints.size(), record.steps.size());
  double farthest = 0.0;
  for (std::size_t k = 0; k < joints.size(); ++k)
    farthest = std::max(farthest, (joints[k] - record.steps[k].joints).cwiseAbs().maxCoeff());
  EXPECT_LT(farthest, 1e-10);
  EXPECT_EQ(system.guardActions(), 0u);
}

TEST(Catheters, DoInLockStepWhatOneProcessDoes) { expectSameAsInOneProcess("ablation-pair", pathText("z")); }

TEST(Catheters, ThatAssistDoInLockStepWhatOneProcessDoes) {
  expectSameAsInOneProcess("ablation-assist", pathText("x"));
}

TEST(Catheters, FollowAPathInRealTime) {
  System system("ablation-pair");
  system.run(0.1);
  system.order(dds::ControlKind::kAcquireLease);
  system.command(StateCommand::kEnable);
  system.run(0.1);
  system.order(dds::ControlKind::kKeepLease);
  ASSERT_EQ(system.shown(0), OperatingState::kEnabled);
  safety::RobotVector home, q;
  ASSERT_TRUE(dds::measuredJoints(system.state, 2, 6, home));
  const dds::Reply reply = system.startText(pathText("z"));
  ASSERT_EQ(reply.accepted, 1) << reply.reason;
  double error = 0.0, farthest = 0.0;
  const auto ended = [&] {
    if (system.ticks % 100 == 0)
      system.order(dds::ControlKind::kKeepLease);
    error = std::max(error, system.output.status.task_error[0]);
    dds::measuredJoints(system.state, 2, 6, q);
    farthest = std::max(farthest, (q - home).cwiseAbs().maxCoeff());
    return static_cast<planning::Phase>(system.reference_message.phase) != planning::Phase::kRunning &&
           system.ticks > 500;
  };
  ASSERT_GT(system.until(ended, 4.0), 0.0);
  EXPECT_EQ(static_cast<planning::Phase>(system.reference_message.phase), planning::Phase::kFinished)
      << system.planning.ended();
  EXPECT_LT(error, 5e-5) << "of what is moved";
  EXPECT_GT(farthest, 3e-4) << "it has been there";
  EXPECT_LT((q - home).cwiseAbs().maxCoeff(), 1e-4) << "the path ends where it began";
  EXPECT_EQ(system.output.status.hold, 0);
}

TEST(Catheters, RefuseAPathWhoseDirectionsAreMissingWithTheirNames) {
  Stepped system("ablation-pair");
  const dds::Reply reply = system.startText(pathText("x"));
  EXPECT_EQ(reply.accepted, 0);
  EXPECT_NE(reply.reason.find("the path asks for translation along x"), std::string::npos) << reply.reason;
  EXPECT_NE(reply.reason.find("possible: "), std::string::npos) << reply.reason;
}

TEST(Catheters, RefuseTrajectoriesOfTubesAndPlans) {
  Stepped system("ablation-pair");
  planning::TrajectorySpec spec;
  spec.name = "line";
  spec.shape = planning::Line{{0.0, 0.02, 0.0}};
  EXPECT_NE(system.start(spec).reason.find("path/1"), std::string::npos) << system.start(spec).reason;
  dds::PlanningRequest request;
  request.client = 7;
  request.kind = 1;
  request.planned = 1;
  request.trajectory = pathText("z");
  std::optional<dds::Path> path;
  const dds::Reply reply = system.planning.onRequest(request, path);
  EXPECT_EQ(reply.reason.find("planned: found 1, expected 0"), 0u) << reply.reason;
}

TEST(Catheters, StopLatchesOnAPathAndMoveJpFollowsAfterwards) {
  System system("ablation-pair");
  system.run(0.1);
  system.order(dds::ControlKind::kAcquireLease);
  system.command(StateCommand::kEnable);
  system.run(0.1);
  ASSERT_EQ(system.startText(pathText("z")).accepted, 1);
  system.run(0.4);
  ASSERT_FALSE(system.standing());
  system.order(dds::ControlKind::kKeepLease);
  system.control.stop();
  system.sim.onStop();
  system.run(0.5);
  system.order(dds::ControlKind::kKeepLease);
  EXPECT_TRUE(system.standing());
  EXPECT_EQ(system.shown(0), OperatingState::kFault);
  EXPECT_EQ(static_cast<planning::Phase>(system.reference_message.phase), planning::Phase::kFailed);
  EXPECT_NE(system.planning.ended().find("became FAULT"), std::string::npos) << system.planning.ended();
  system.command(StateCommand::kDisable);
  system.run(0.2);
  system.order(dds::ControlKind::kKeepLease);
  system.command(StateCommand::kEnable);
  system.run(0.2);
  service::ControlOrder move;
  move.client = 7;
  move.kind = dds::ControlKind::kMoveJp;
  move.arm = 0;
  move.joint_count = 3;
  const safety::ArmVector home = system.setup.robot.arms[0].home;
  for (int j = 0; j < 3; ++j)
    move.joints[static_cast<std::size_t>(j)] = home[j];
  ASSERT_EQ(system.control.order(move, system.now).code, dds::ReplyCode::kOk);
  system.run(0.5);
  EXPECT_LT((dds::jointsOf(system.state.position, 0, 3) - home).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Catheters, AreNotMovedTipByTip) {
  System system("ablation-pair");
  system.run(0.2);
  service::CrtkOrder order;
  order.group = 0;
  for (std::size_t verb = 0; verb < service::kCrtkVerbs.size(); ++verb) {
    const service::CrtkVerb& v = service::kCrtkVerbs[verb];
    if (v.level == service::CrtkLevel::kHold || v.space == service::CrtkSpace::kJoint)
      continue;
    order.verb = static_cast<int>(verb);
    const service::CrtkOutcome outcome = system.control.crtk(order, system.now);
    EXPECT_NE(std::string(outcome.reason.data()).find("not tip by tip"), std::string::npos) << verb;
  }
}

TEST(FrameLoop, HoldsWithoutAFreshRest) {
  const service::Setup setup = makeSetup("ablation-pair");
  const experiments::RobotModel model(setup.robot);
  const auto tracker = service::OrderDesk(setup, model).makeTracker();
  service::FrameLoop loop(setup);
  safety::RobotVector home(6), still = safety::RobotVector::Zero(6);
  home << setup.robot.arms[0].home, setup.robot.arms[1].home;
  const auto mechanism = service::makeMechanism(setup.robot);
  ASSERT_EQ(mechanism->settle(home), "");
  planning::Reference tasks;
  tasks.task_count = 1;
  tasks.tasks[0].kind = planning::TaskKind::kFrame;
  tasks.frame.position = mechanism->pose().translation() + Eigen::Vector3d(0.0, 0.0, 1e-4);
  tasks.frame.orientation = Eigen::Quaterniond(mechanism->pose().linear());
  tasks.frame.tracked[2] = true;
  planning::TrackResult result;
  std::int64_t now = 1'000'000'000;
  const auto step = [&] { return loop.step(now, home, still, tasks, *tracker, result); };
  EXPECT_EQ(step(), dds::HoldReason::kNoRest) << "none yet";
  EXPECT_EQ(result.status, planning::TrackStatus::kRest);
  EXPECT_TRUE(result.solution.velocity.isZero(0.0));
  loop.ask(now, home, still, *tracker);
  EXPECT_EQ(step(), dds::HoldReason::kNone);
  EXPECT_EQ(result.status, planning::TrackStatus::kOk);
  EXPECT_NEAR(result.error[0], 1e-4, 1e-9);
  EXPECT_GT(result.solution.velocity.norm(), 1e-5);
  now += 40'000'000;
  EXPECT_EQ(step(), dds::HoldReason::kNone) << "an older one will do";
  now += 400'000'000;
  EXPECT_EQ(step(), dds::HoldReason::kNoRest) << "too old";
  loop.ask(now, home, still, *tracker);
  EXPECT_EQ(step(), dds::HoldReason::kNone);
  loop.restart();
  EXPECT_EQ(step(), dds::HoldReason::kNoRest) << "of joints that have been put elsewhere";
  loop.ask(now, home, still, *tracker);
  EXPECT_EQ(step(), dds::HoldReason::kNone);
}

TEST(Settler, AnswersFromItsThread) {
  const service::Setup setup = makeSetup("ablation-pair");
  service::Settler settler(setup);
  settler.start();
  service::Settler::Wish wish;
  wish.stamp = 5;
  wish.joint_count = 6;
  Eigen::Vector3d::Map(wish.joints.data()) = setup.robot.arms[0].home;
  Eigen::Vector3d::Map(wish.joints.data() + 3) = setup.robot.arms[1].home;
  settler.ask(wish);
  settler.stop();  // after what was asked for
  service::Settler::Answer answer;
  ASSERT_TRUE(settler.take(answer));
  EXPECT_EQ(answer.stamp, 5);
  EXPECT_EQ(answer.rest.joint_count, 6);
}

TEST(CatheterTips, AreWhereTheArmsAreAtRest) {
  System system("ablation-pair");
  system.run(0.1);
  service::CatheterMoment moment;
  system.sim.trueJoints(moment);
  ASSERT_EQ(moment.joint_count, 6);
  const dds::TipPoses tips = service::CatheterTips(system.setup).at(moment);
  service::CatheterPlaces places(system.setup, system.model);
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

TEST(Catheters, FramesCrossTheWire) {
  planning::Reference reference;
  reference.task_count = 1;
  reference.tasks[0].kind = planning::TaskKind::kFrame;
  reference.frame.position = {0.1, 0.2, 0.3};
  reference.frame.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY()));
  reference.frame.feed_forward << 1, 2, 3, 4, 5, 6;
  reference.frame.tracked = {true, false, true, false, false, true};
  dds::PlanningReference message;
  dds::setTasks(reference, message);
  const planning::FrameReference back = dds::tasksOf(message).frame;
  EXPECT_EQ(back.position, reference.frame.position);
  EXPECT_EQ(back.orientation.coeffs(), reference.frame.orientation.coeffs());
  EXPECT_EQ(back.tracked, reference.frame.tracked);
  for (int k = 0; k < 6; ++k)
    EXPECT_EQ(back.feed_forward[k], back.tracked[static_cast<std::size_t>(k)] ? k + 1.0 : 0.0);
}

}  // namespace
}  // namespace tandem::test
