// SPDX-License-Identifier: Apache-2.0
/** @file Orientations commanded by operators and CRTK clients, with control and the simulated robot. */
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "operation/convert.h"
#include "planning/teleoperation/spaces.h"
#include "robots/orientation_freedom.h"
#include "tests/unit/safety/allocation_counter.h"
#include "tests/unit/services/system.h"

namespace tandem::test::orientation {
namespace {

using dds::ControlKind;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using operation::CrtkOutcome;
using operation::CrtkRequest;
using planning::teleoperation::Mode;
using planning::teleoperation::Orientations;
using planning::teleoperation::State;
using planning::teleoperation::TipOrientation;
using safety::StateCommand;

constexpr std::uint64_t kOperator = 7;
constexpr double kDegree = std::numbers::pi / 180.0;
/// Axes about which the joints at home turn the tips fastest, behind the positions: the first left singular vectors.
/// The other two directions need 10 and 30 times the joint motion.
const Vector3d kAxisA = Vector3d(0.073, 0.271, 0.960).normalized(), kAxisB = Vector3d(0.068, 0.100, 0.993).normalized();

Quaterniond turn(double angle, const Vector3d& axis = kAxisA) { return Quaterniond(Eigen::AngleAxisd(angle, axis)); }

template <TipOrientation kFollowed>
void follows(config::Deployment& d) {
  d.control_period = 0.01;
  d.teleoperation.options.rotation.followed = kFollowed;
}

double angleBetween(const Quaterniond& a, const Quaterniond& b) { return Orientations{}.difference(a, b).norm(); }
double axisAngle(const Quaterniond& a, const Quaterniond& b) { return Orientations{true}.difference(a, b).norm(); }

struct Turned : System {
  explicit Turned(Change change) : System("laptop", change) {
    input.client = kOperator;
    input.mode = static_cast<std::uint8_t>(Mode::kPair);
    input.other_arm = 1;
    input.kind = 1;
    input.device = 4;
  }
  /// A client of CRTK releases the lease, an operator keeps it with a released switch.
  void enable(std::uint64_t client) {
    run(0.3);
    sendRequest(ControlKind::kAcquireLease, client);
    command(StateCommand::kEnable, client);
    run(0.3);
    if (client == kOperator)
      operate(0.1);
    else
      sendRequest(ControlKind::kReleaseLease, client);
  }
  /// An operator who sends 100 times a second.
  void operate(double seconds) {
    for (int i = 0; i < std::lround(1000 * seconds); ++i) {
      if (ticks % 10 == 0) {
        input.control_session = output.status.session;
        input.answers_control = output.status.sequence;
        ++input.sequence;
        control.onInput(input, now);
      }
      if (ticks % 200 == 0)
        sendRequest(ControlKind::kKeepLease, kOperator);
      tick();
    }
    control.fillSnapshots(now, snapshot, crtk);
  }
  /// A CRTK client that sends 100 times a second.
  template <class Request>
  void stream(double seconds, Request request) {
    for (int i = 0; i < std::lround(100 * seconds); ++i) {
      const CrtkOutcome outcome = control.crtk(request(), now);
      ASSERT_TRUE(outcome.accepted) << outcome.reason.data();
      run(0.01);
    }
    control.fillSnapshots(now, snapshot, crtk);
  }
  kinematics::TaskPlace tip(int k) {
    kinematics::Tip found;
    const safety::ArmVector q = dds::jointsOf(state.position, k, model.size(k));
    EXPECT_EQ(model.models()[static_cast<std::size_t>(k)]->tip(q, found), kinematics::ModelStatus::kOk);
    return {found.pose.translation(), Quaterniond(found.pose.linear())};
  }

  dds::TeleopInput input;
  operation::OperatorSnapshot snapshot;
  operation::CrtkSnapshot crtk;
};

CrtkRequest requestFor(std::string_view name, const kinematics::TaskPlace& pose) {
  CrtkRequest request;
  while (operation::kCrtkVerbs[static_cast<std::size_t>(request.verb)].name != name)
    ++request.verb;
  request.count = 3;
  Vector3d::Map(request.values.data()) = pose.position;
  Eigen::Vector4d::Map(request.orientation.data()) = pose.orientation.coeffs();
  return request;
}
CrtkRequest velocity(std::string_view name, const Vector3d& linear, const Vector3d& angular) {
  CrtkRequest request = requestFor(name, {linear, Quaterniond::Identity()});
  Vector3d::Map(request.angular.data()) = angular;
  return request;
}

TEST(OperatedOrientation, TheTipTurnsWithTheDeviceAndThePositionsAreKept) {
  for (const Change change : {follows<TipOrientation::kFull>, follows<TipOrientation::kAxis>}) {
    Turned s(change);
    s.enable(kOperator);
    const kinematics::TaskPlace start = s.tip(0), other = s.tip(1);
    s.input.operator_present = 1;
    Vector3d::Map(s.input.angular.data()) = 0.1 * kAxisA;
    s.operate(1.5);
    EXPECT_EQ(s.snapshot.state, State::kFollowing);
    EXPECT_EQ(s.output.status.task_count, 3);
    s.input.angular = {0.0, 0.0, 0.0};
    s.operate(1.0);
    const auto& rotation = s.setup.deployment.teleoperation.options.rotation;
    const double asked = 1.5 * (0.1 - rotation.deadband_speed);
    const Quaterniond goal = turn(asked) * start.orientation;
    EXPECT_GT(axisAngle(s.tip(0).orientation, start.orientation), 0.3 * asked);
    EXPECT_LT(rotation.space().difference(s.tip(0).orientation, goal).norm(), 0.1 * asked);
    EXPECT_LT((s.tip(0).position - start.position).norm(), 0.1e-3);
    EXPECT_LT((s.tip(0).position - s.tip(1).position - start.position + other.position).norm(), 0.1e-3);
    EXPECT_EQ(s.guardActions(), 0u);
  }
}

TEST(OperatedOrientation, IsKeptWhileTheTipMoves) {
  const auto turned = [](Change change) {
    Turned s(change);
    s.enable(kOperator);
    const Quaterniond start = s.tip(0).orientation;
    s.input.operator_present = 1;
    s.input.linear = {0.0, 0.006, 0.0};
    s.operate(1.5);
    return angleBetween(s.tip(0).orientation, start);
  };
  EXPECT_LT(turned(follows<TipOrientation::kFull>), 0.3 * turned(follows<TipOrientation::kIgnored>));
}

TEST(OperatedOrientation, AHandleTurnsTheTipFromWhereItWasGripped) {
  Turned s(follows<TipOrientation::kFull>);
  s.enable(kOperator);
  const kinematics::TaskPlace start = s.tip(0);
  s.input.kind = 2;
  const Quaterniond gripped = Quaterniond(0.5, 0.5, -0.5, 0.5);
  const auto hold = [&](double angle) {
    const Quaterniond handle = turn(angle) * gripped;
    Eigen::Vector4d::Map(s.input.orientation.data()) = handle.coeffs();
  };
  hold(0.0);
  s.operate(0.1);
  s.input.operator_present = 1;
  s.operate(0.5);
  EXPECT_LT(angleBetween(s.tip(0).orientation, start.orientation), 1e-3) << "gripping moves nothing";
  for (int i = 1; i <= 50; ++i) {
    hold(0.002 * i);
    s.operate(0.02);
  }
  s.operate(1.0);
  const Quaterniond goal = turn(0.1) * start.orientation;
  EXPECT_LT(angleBetween(s.tip(0).orientation, goal), 0.01);
  s.input.clutch = 1;
  s.operate(0.1);
  hold(-1.0);
  s.operate(0.2);
  s.input.clutch = 0;
  const Quaterniond there = s.tip(0).orientation;
  s.operate(0.5);
  EXPECT_LT(angleBetween(s.tip(0).orientation, there), 0.01) << "the clutch re-indexes";
}

TEST(OperatedOrientation, BadQuaternionsAreRefusedUnlessTheyAreIgnored) {
  for (const bool ignored : {false, true}) {
    Turned s(ignored ? follows<TipOrientation::kIgnored> : follows<TipOrientation::kFull>);
    s.enable(kOperator);
    s.input.kind = 2;
    for (const std::array<double, 4>& bad : {std::array{0.0, 0.0, 0.0, 0.0}, std::array{0.0, 0.0, 0.0, 1.1}}) {
      const std::uint64_t before = s.snapshot.refused;
      s.input.orientation = bad;
      s.operate(0.05);
      EXPECT_EQ(s.snapshot.refused > before, !ignored);
      EXPECT_EQ(s.snapshot.refusal != operation::Reason::kNone, !ignored);
    }
  }
}

TEST(OperatedOrientation, BadSamplesOfThePageAreRefusedAndTurnNothing) {
  using enum idl::RefusalReason;
  Turned s(follows<TipOrientation::kFull>);
  s.enable(kOperator);
  s.input.operator_present = 1;
  s.operate(0.2);
  const Quaterniond start = s.tip(0).orientation;
  /// Keys and sticks send rates in the axes of the view, the ring an orientation in those of the base frame.
  const auto refusal = [&](bool ring, auto change) {
    dds::TeleopInput bad = s.input;
    bad.control_session = s.output.status.session;
    bad.answers_control = s.output.status.sequence;
    bad.sequence += 1;
    bad.kind = ring ? 2 : 1;
    bad.frame = ring ? 0 : 1;
    bad.view = {0.0, 0.6, 0.0, 0.8};
    Vector3d::Map(bad.angular.data()) = 0.5 * kAxisA;
    Eigen::Vector4d::Map(bad.orientation.data()) = turn(0.5).coeffs();
    change(bad);
    const std::uint64_t before = s.snapshot.accepted;
    s.control.onInput(bad, s.now);
    s.control.fillSnapshots(s.now, s.snapshot, s.crtk);
    EXPECT_EQ(s.snapshot.accepted, before);
    const operation::Reason reason = s.snapshot.refusal;
    s.run(0.03);
    return reason;
  };
  EXPECT_EQ(refusal(false, [](auto& m) { m.angular[2] = std::nan(""); }), kNotFinite);
  EXPECT_EQ(refusal(false, [](auto& m) { m.angular[0] = -INFINITY; }), kNotFinite);
  EXPECT_EQ(refusal(false, [](auto& m) { m.view[3] = 0.0; }), kView);
  EXPECT_EQ(refusal(true, [](auto& m) { m.orientation[1] = std::nan(""); }), kNotFinite);
  EXPECT_EQ(refusal(true, [](auto& m) { m.orientation.fill(0.0); }), kView);
  EXPECT_EQ(refusal(true, [](auto& m) { m.orientation[3] += 0.1; }), kView);
  for (const bool ring : {false, true}) {
    s.operate(0.02);
    EXPECT_EQ(refusal(ring, [](auto& m) { m.client = 8; }), kNotCommander);
    EXPECT_EQ(refusal(ring, [](auto& m) { m.control_session += 1; }), kOtherControl);
    EXPECT_EQ(refusal(ring, [](auto& m) { m.sequence -= 1; }), kOutOfSequence);
    s.run(0.15);
    const std::uint64_t old = s.input.answers_control;
    EXPECT_EQ(refusal(ring, [old](auto& m) { m.answers_control = old; }), kLate);
  }
  EXPECT_LT(angleBetween(s.tip(0).orientation, start), 1e-3);
  s.input.operator_present = 0;  // as after each stop, it has to be released first
  s.operate(0.1);
  s.input.operator_present = 1;
  Vector3d::Map(s.input.angular.data()) = 0.1 * kAxisA;
  s.operate(1.0);
  EXPECT_GT(angleBetween(s.tip(0).orientation, start), 0.03) << "a good one turns";
}

TEST(CrtkOrientation, EveryCommandTurnsTheTipAndKeepsItsPosition) {
  Turned s(follows<TipOrientation::kFull>);
  s.enable(9);
  const kinematics::TaskPlace start = s.tip(0);
  const auto turned_by = [&](double angle) {
    return kinematics::TaskPlace{start.position, turn(angle) * start.orientation};
  };
  const auto expect_at = [&](double angle, const char* what, double tolerance = 0.01) {
    EXPECT_LT(angleBetween(s.tip(0).orientation, turned_by(angle).orientation), tolerance) << what;
    EXPECT_LT((s.tip(0).position - start.position).norm(), 0.1e-3) << what;
  };
  double angle = 0.0;
  s.stream(1.0, [&] { return requestFor("servo_cp", turned_by(angle += 1e-3)); });
  s.stream(0.5, [&] { return requestFor("servo_cp", turned_by(angle)); });
  expect_at(0.1, "servo_cp");
  const kinematics::TaskPlace little{Vector3d::Zero(), turn(-1e-3)};
  s.stream(0.5, [&] { return requestFor("servo_cr", little); });
  s.run(0.05);
  expect_at(0.05, "servo_cr", 0.02);
  s.run(0.3);
  s.stream(0.5, [&] { return velocity("servo_cv", Vector3d::Zero(), 0.1 * kAxisA); });
  s.run(0.3);
  expect_at(0.1, "servo_cv", 0.03);
  s.stream(1.5, [&] { return requestFor("interpolate_cp", turned_by(0.0)); });
  expect_at(0.0, "interpolate_cp");
  EXPECT_LT(angleBetween(Quaterniond(Eigen::Vector4d(s.crtk.cp_orientation[0].data())), start.orientation), 1e-9);
  s.run(0.5);
  s.stream(0.5, [&] { return velocity("interpolate_cv", Vector3d::Zero(), 0.1 * kAxisA); });
  EXPECT_DOUBLE_EQ(s.crtk.cv_angular[0][2], 0.1 * kAxisA.z());
  s.run(0.5);
  EXPECT_GT(angleBetween(s.tip(0).orientation, start.orientation), 0.03) << "interpolate_cv";
  for (const double to : {0.1, -0.05}) {
    ASSERT_TRUE(s.control.crtk(requestFor("move_cp", turned_by(to)), s.now).accepted);
    s.run(0.1);
    EXPECT_NE(s.output.status.busy[0], 0);
    EXPECT_GE(s.until([&] { return s.output.status.busy[0] == 0; }, 5.0), 0.0);
    expect_at(to, "move_cp");
  }
  ASSERT_TRUE(s.control.crtk(requestFor("move_cr", {Vector3d::Zero(), turn(0.05)}), s.now).accepted);
  s.run(0.1);
  EXPECT_GE(s.until([&] { return s.output.status.busy[0] == 0; }, 5.0), 0.0);
  expect_at(0.0, "move_cr");
  EXPECT_TRUE(s.endings.empty() || std::string(s.endings.back().reason.data()).find("progress") == std::string::npos);
}

TEST(CrtkOrientation, AMotionThatOnlyTurnsGoesOnToItsGoal) {
  Turned s([](config::Deployment& d) {
    follows<TipOrientation::kFull>(d);
    d.teleoperation.options.rotation.max_speed = 0.05;
  });
  s.enable(9);
  kinematics::TaskPlace goal = s.tip(0);
  goal.orientation = turn(0.25) * goal.orientation;
  ASSERT_TRUE(s.control.crtk(requestFor("move_cp", goal), s.now).accepted);
  s.run(0.1);
  EXPECT_GE(s.until([&] { return s.output.status.busy[0] == 0; }, 10.0), 4.0)
      << "longer than the time without progress";
  EXPECT_LT(angleBetween(s.tip(0).orientation, goal.orientation), 5e-3);
}

TEST(CrtkOrientation, AStepThatIsTooLargeIsRefusedAndIgnoredOrientationsAreNot) {
  for (const bool ignored : {false, true}) {
    Turned s(ignored ? follows<TipOrientation::kIgnored> : follows<TipOrientation::kFull>);
    s.enable(9);
    kinematics::TaskPlace pose = s.tip(0);
    const Quaterniond start = pose.orientation;
    pose.orientation = turn(30.0 * kDegree) * pose.orientation;
    const CrtkOutcome outcome = s.control.crtk(requestFor("servo_cp", pose), s.now);
    EXPECT_EQ(outcome.accepted, ignored);
    if (!ignored) {
      EXPECT_NE(std::string(outcome.reason.data()).find("found a rotation of 30.000 deg"), std::string::npos)
          << outcome.reason.data();
    }
    s.run(0.5);
    EXPECT_LT(angleBetween(s.tip(0).orientation, start), 1e-3);
  }
}

TEST(CrtkOrientation, BothTipsHaveTheirOwnAndThePairHasNone) {
  Turned s(follows<TipOrientation::kFull>);
  s.enable(9);
  const kinematics::TaskPlace a = s.tip(0), b = s.tip(1);
  for (int i = 1; i <= 100; ++i) {
    for (int k = 0; k < 2; ++k) {
      const kinematics::TaskPlace& start = k == 0 ? a : b;
      const double angle = (k == 0 ? 1e-3 : -1e-3) * i;
      CrtkRequest request =
          requestFor("servo_cp", {start.position, turn(angle, k == 0 ? kAxisA : kAxisB) * start.orientation});
      request.group = k;
      const CrtkOutcome outcome = s.control.crtk(request, s.now);
      ASSERT_TRUE(outcome.accepted) << outcome.reason.data();
    }
    s.run(0.01);
  }
  EXPECT_EQ(s.output.status.task_count, 4);
  EXPECT_GT(angleBetween(s.tip(0).orientation, a.orientation), 0.07);
  EXPECT_GT(angleBetween(s.tip(1).orientation, b.orientation), 0.07);
  s.run(0.5);
  CrtkRequest request =
      requestFor("servo_cp", {s.tip(0).position - s.tip(1).position, Quaterniond(0.0, 1.0, 0.0, 0.0)});
  request.group = operation::kPairGroup;
  ASSERT_TRUE(s.control.crtk(request, s.now).accepted);
  s.run(0.02);
  EXPECT_EQ(s.output.status.task_count, 2);
}

TEST(CrtkOrientation, TheCycleAllocatesNothing) {
  Turned s(follows<TipOrientation::kFull>);
  s.enable(9);
  kinematics::TaskPlace pose = s.tip(0);
  std::size_t allocated = 0;
  for (int i = 0; i < 50; ++i) {
    pose.orientation = (turn(1e-3) * pose.orientation).normalized();
    const CrtkRequest request = requestFor("interpolate_cp", pose);
    const std::size_t before = allocationCount();
    s.control.crtk(request, s.now);
    s.control.cycle(s.now, false, s.output);
    s.control.fillSnapshots(s.now, s.snapshot, s.crtk);
    allocated += allocationCount() - before;
    s.run(0.01);
  }
  if (canCountAllocations()) {
    EXPECT_EQ(allocated, 0u);
  }
}

TEST(Orientation, AnArmWithoutTheRankIsNamedBeforeTheStart) {
  const auto refused = [](const std::string& deployment, TipOrientation orientation) {
    runtime::Setup setup = makeSetup(deployment);
    setup.deployment.teleoperation.options.rotation.followed = orientation;
    try {
      robots::requireOrientation(setup.deployment, setup.robot);
    } catch (const config::Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  for (const auto orientation : {TipOrientation::kIgnored, TipOrientation::kAxis, TipOrientation::kFull})
    EXPECT_EQ(refused("laptop", orientation), "");
  EXPECT_EQ(refused("planar-pair", TipOrientation::kIgnored), "");
  const std::string why = refused("planar-pair", TipOrientation::kAxis);
  EXPECT_NE(why.find("teleoperation.orientation: found axis with arm_"), std::string::npos) << why;
  EXPECT_NE(why.find("expected rank 2"), std::string::npos) << why;
  EXPECT_NE(refused("planar-pair", TipOrientation::kFull).find("expected rank 3"), std::string::npos);
  EXPECT_NE(refused("ablation-pair", TipOrientation::kFull).find("catheters"), std::string::npos);
}

}  // namespace
}  // namespace tandem::test::orientation
