// SPDX-License-Identifier: Apache-2.0
/** @file Catheters through simulator, control and planning, without DDS. */
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "catheter_system.h"
#include "config/path.h"
#include "operation/convert.h"
#include "robots/catheters.h"
#include "robots/robot_type.h"
#include "robots/track.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::test {
namespace {

using safety::OperatingState;
using safety::StateCommand;

/// The period of the robot file, possible since a simulation is never late.
void atHundredHertz(config::Deployment& deployment) { deployment.control_period = 0.01; }

/// The pair with squeeze on its object: at home it has none, so that a path must be prepared.
std::filesystem::path squeezedPair() {
  std::ifstream from(std::string(TANDEM_PRESETS) + "/cooperative/ablation-pair.yaml");
  std::string text(std::istreambuf_iterator<char>(from), {});
  const std::string at = "  size_mm: 14\n";
  text.replace(text.find(at), at.size(), at + "  squeeze_N: 0.002\n");
  for (std::size_t rigid; (rigid = text.find("type: rigid")) != std::string::npos;)
    text.replace(rigid, 11, "type: soft_finger");
  std::filesystem::path file =
      std::filesystem::path(::testing::TempDir()) / ("squeezed-" + std::to_string(runtime::randomIdentity()) + ".yaml");
  std::ofstream(file) << text;
  return file;
}

void squeezed(config::Deployment& deployment) {
  inStep(deployment);
  deployment.robot = squeezedPair();
}

/// In lock-step the services give the same joints as one process.
/// @return number of steps before the path
int expectSameAsInOneProcess(const std::string& preset, const std::string& text, Change change = inStep) {
  Stepped system(preset, change);
  const auto mechanism = robots::typeOf(system.setup.robot).makeMechanism(system.setup.robot);
  planning::ObjectPath path = config::parsePath(text, "test");
  path.length = mechanism->length();
  robots::TrackOptions options;
  options.parameters = system.setup.robot.parameters;
  options.parameters.period = system.setup.deployment.control_period;
  options.gain = 5.0;
  const robots::TrackRecord record = robots::track(*mechanism, path, options);
  EXPECT_TRUE(record.good()) << record.refused << record.stopped;
  const dds::Reply reply = system.startText(text);
  EXPECT_EQ(reply.accepted, 1) << reply.reason;
  const auto joints = system.walk();
  EXPECT_EQ(system.phase(), planning::Phase::kFinished) << system.planning.ended();
  EXPECT_EQ(joints.size(), record.steps.size());
  double farthest = 0.0;
  for (std::size_t k = 0; k < std::min(joints.size(), record.steps.size()); ++k)
    farthest = std::max(farthest, (joints[k] - record.steps[k].joints).cwiseAbs().maxCoeff());
  EXPECT_LT(farthest, 1e-10);
  EXPECT_EQ(system.guardActions(), 0u);
  return static_cast<int>(
      std::ranges::count_if(record.steps, [](const robots::TrackStep& step) { return step.time < 0.0; }));
}

TEST(Catheters, LockStepEqualsOneProcess) { expectSameAsInOneProcess("ablation-pair", pathText("z")); }

TEST(Catheters, TargetAssistLockStepEqualsOneProcess) { expectSameAsInOneProcess("ablation-assist", pathText("x")); }

TEST(Catheters, ReachTheSpecifiedSqueezeBeforeTheyMove) {
  std::string text = pathText("z");
  text.replace(text.find("duration_s: 1"), 13, "duration_s: 0.2");
  EXPECT_GT(expectSameAsInOneProcess("ablation-pair", text, squeezed), 10);
}

TEST(Catheters, FollowAPathInRealTime) {
  System system("ablation-pair", atHundredHertz);
  system.run(0.1);
  system.sendRequest(dds::ControlKind::kAcquireLease);
  system.command(StateCommand::kEnable);
  system.run(0.1);
  system.sendRequest(dds::ControlKind::kKeepLease);
  ASSERT_EQ(system.shown(0), OperatingState::kEnabled);
  safety::RobotVector home, q;
  ASSERT_TRUE(dds::measuredJoints(system.state, 2, 6, home));
  const dds::Reply reply = system.startText(pathText("z"));
  ASSERT_EQ(reply.accepted, 1) << reply.reason;
  double error = 0.0, farthest = 0.0;
  const auto ended = [&] {
    if (system.ticks % 100 == 0)
      system.sendRequest(dds::ControlKind::kKeepLease);
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
  EXPECT_NE(reply.reason.find("the path requires translation along x"), std::string::npos) << reply.reason;
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
  EXPECT_EQ(reply.reason.find("planned: found 1; robot: found the catheters of "), 0u) << reply.reason;
}

TEST(Catheters, StopLatchesOnAPathAndMoveJpFollowsAfterwards) {
  System system("ablation-pair", atHundredHertz);
  system.run(0.1);
  system.sendRequest(dds::ControlKind::kAcquireLease);
  system.command(StateCommand::kEnable);
  system.run(0.1);
  ASSERT_EQ(system.startText(pathText("z")).accepted, 1);
  system.run(0.4);
  ASSERT_FALSE(system.standing());
  system.sendRequest(dds::ControlKind::kKeepLease);
  system.control.stop();
  system.sim.onStop();
  system.run(0.5);
  system.sendRequest(dds::ControlKind::kKeepLease);
  EXPECT_TRUE(system.standing());
  EXPECT_EQ(system.shown(0), OperatingState::kFault);
  EXPECT_EQ(static_cast<planning::Phase>(system.reference_message.phase), planning::Phase::kFailed);
  EXPECT_NE(system.planning.ended().find("became FAULT"), std::string::npos) << system.planning.ended();
  system.command(StateCommand::kDisable);
  system.run(0.2);
  system.sendRequest(dds::ControlKind::kKeepLease);
  system.command(StateCommand::kEnable);
  system.run(0.2);
  operation::ParsedControlRequest move;
  move.client = 7;
  move.kind = dds::ControlKind::kMoveJp;
  move.arm = 0;
  move.joint_count = 3;
  const safety::ArmVector home = system.setup.robot.arms[0].home;
  for (int j = 0; j < 3; ++j)
    move.joints[static_cast<std::size_t>(j)] = home[j];
  ASSERT_EQ(system.control.onRequest(move, system.now).refusal.code(), dds::ReplyCode::kOk);
  system.run(0.5);
  EXPECT_LT((dds::jointsOf(system.state.position, 0, 3) - home).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Catheters, HoldThenFaultWithoutEquilibrium) {
  System system("ablation-pair", atHundredHertz);
  system.run(0.1);
  system.sendRequest(dds::ControlKind::kAcquireLease);
  system.command(StateCommand::kEnable);
  system.run(0.1);
  ASSERT_EQ(system.startText(pathText("z")).accepted, 1);
  system.run(0.3);
  system.sendRequest(dds::ControlKind::kKeepLease);
  EXPECT_EQ(system.output.status.hold, 0);
  EXPECT_EQ(dds::name(static_cast<dds::Model>(system.output.status.model)), "elastic");
  system.object_loop->start();
  system.object_loop->stop();  // no equilibrium is computed from here on
  const auto held = [&] {
    return static_cast<dds::HoldReason>(system.output.status.hold) == dds::HoldReason::kNoEquilibrium;
  };
  const double until = system.until(held, 0.2);
  EXPECT_GE(until, 0.03) << "rests are used up to an age";
  EXPECT_LE(until, 0.08);
  EXPECT_EQ(system.shown(0), OperatingState::kEnabled);
  EXPECT_NE(dds::name(dds::HoldReason::kNoEquilibrium).find("no equilibrium"), std::string_view::npos);
  const auto faulted = [&] { return system.shown(0) == OperatingState::kFault; };
  EXPECT_GT(system.until(faulted, 0.2), 0.01);
  EXPECT_EQ(system.control.faultRecord(0).faults, bit(safety::Fault::kSolver));
  EXPECT_EQ(system.control.faultRecord(0).cause, safety::FaultCause::kModel);
}

TEST(Catheters, CyclesAllocateNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "a sanitizer has its own allocator";
  System system("ablation-pair", atHundredHertz);
  system.run(0.1);
  system.sendRequest(dds::ControlKind::kAcquireLease);
  system.command(StateCommand::kEnable);
  system.run(0.1);
  ASSERT_EQ(system.startText(pathText("z")).accepted, 1);
  system.run(0.2);
  system.object_loop->start();
  const std::size_t before = allocationCount();
  for (int i = 0; i < 3; ++i)
    system.control.cycle(system.now, false, system.output);
  const std::size_t after = allocationCount();
  system.object_loop->stop();
  EXPECT_EQ(after, before);
  EXPECT_EQ(system.output.status.task_count, 1) << "it follows";
}

TEST(Catheters, AreNotDrivenByAnOperator) {
  System system("ablation-pair", atHundredHertz);
  dds::TeleopInput input;
  input.client = 7;
  input.mode = static_cast<std::uint8_t>(planning::teleoperation::Mode::kPair);
  input.other_arm = 1;
  input.kind = 1;
  input.device = 4;
  input.linear = {0.0, 0.0, 1e-3};
  const auto drive = [&](double seconds, bool present) {
    input.operator_present = present ? 1 : 0;
    for (int i = 0; i < static_cast<int>(100 * seconds); ++i) {
      system.run(0.01);
      input.control_session = system.output.status.session;
      input.answers_control = system.output.status.sequence;
      ++input.sequence;
      system.control.onInput(input, system.now);
    }
    system.sendRequest(dds::ControlKind::kKeepLease);
  };
  system.run(0.1);
  system.sendRequest(dds::ControlKind::kAcquireLease);
  system.command(StateCommand::kEnable);
  drive(0.3, false);
  ASSERT_EQ(system.shown(0), OperatingState::kEnabled);
  const auto before = system.state.position;
  drive(0.3, true);
  operation::OperatorSnapshot snapshot;
  operation::CrtkSnapshot crtk;
  system.control.fillSnapshots(system.now, snapshot, crtk);
  EXPECT_EQ(snapshot.reason, operation::Reason::kCommonObject);
  EXPECT_NE(std::string(operation::describeOperatorStop(snapshot.reason)).find("not tip commands"), std::string::npos);
  EXPECT_EQ(system.state.position, before);
}

TEST(Catheters, AreNotMovedTipByTip) {
  System system("ablation-pair", atHundredHertz);
  system.run(0.2);
  operation::CrtkRequest request;
  request.group = 0;
  for (std::size_t verb = 0; verb < operation::kCrtkVerbs.size(); ++verb) {
    const operation::CrtkVerb& v = operation::kCrtkVerbs[verb];
    if (v.level == operation::CrtkLevel::kHold || v.space == operation::CrtkSpace::kJoint)
      continue;
    request.verb = static_cast<int>(verb);
    const operation::CrtkOutcome outcome = system.control.crtk(request, system.now);
    EXPECT_NE(std::string(outcome.reason.data()).find("not tip commands"), std::string::npos) << verb;
  }
}

}  // namespace
}  // namespace tandem::test
