// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "operation/convert.h"
#include "services/computation/computation.h"
#include "tests/unit/services/system.h"

namespace tandem::test {
namespace {

using dds::ControlKind;

/// A system that is ready to run a line, and the plan for it.
struct Planned {
  Planned() {
    system.run(0.3);
    system.sendRequest(ControlKind::kAcquireLease);
    system.command(safety::StateCommand::kEnable);
    system.run(0.3);
    keep();
    planning::TrajectorySpec spec;
    spec.name = "line";
    spec.shape = planning::Line{{0.0, 0.006, 0.0}};
    spec.point_count = 6;
    start.client = 7;
    start.kind = 1;
    start.planned = 1;
    start.trajectory = config::formatTrajectory(spec);
  }
  void keep() { system.sendRequest(ControlKind::kKeepLease); }
  /// Plan of the trajectory, from the robot's present joints.
  planning_service::Plan plan() const {
    dds::ComputationRequest request;
    request.kind = static_cast<std::uint8_t>(dds::ComputationKind::kCheck);
    request.trajectory = start.trajectory;
    safety::RobotVector q(system.model.jointCount());
    for (int k = 0; k < 2; ++k) {
      for (int j = 0; j < system.model.size(k); ++j)
        q[system.model.offset(k) + j] = system.state.position[dds::jointIndex(k, j)];
    }
    const auto result = computation::Computation(request, {system.setup.robot, system.model, true}, q).run({});
    planning_service::Plan plan{request.trajectory, q, {}};
    for (const dds::PointReport& point : result.report.points)
      plan.points.push_back(Eigen::VectorXd::Map(point.joints.data(), q.size()));
    return plan;
  }
  dds::Reply ask() {
    std::optional<dds::Path> path;
    return system.planning.onRequest(start, path);
  }
  System system;
  dds::PlanningRequest start;
};

TEST(PlannedRun, LeadsTheJointsToThosePlanned) {
  Planned planned;
  const planning_service::Plan plan = planned.plan();
  ASSERT_EQ(plan.points.size(), 6u);
  planned.system.planning.onPlan(plan);
  ASSERT_EQ(planned.ask().accepted, 1) << planned.ask().reason;
  System& s = planned.system;
  int postures = 0;
  const auto ended = [&] {
    const dds::PlanningReference& reference = s.reference_message;
    if (s.ticks % 500 == 0)
      planned.keep();
    if (reference.posture_valid != 0) {
      ++postures;
      EXPECT_EQ(dds::postureOf(reference, s.state.arm_count, s.state.joint_count), plan.points[reference.point - 1]);
    }
    return postures > 0 && static_cast<planning::Phase>(reference.phase) != planning::Phase::kRunning;
  };
  ASSERT_GE(s.until(ended, 300.0), 0.0);
  EXPECT_EQ(static_cast<planning::Phase>(s.reference_message.phase), planning::Phase::kFinished);
  EXPECT_EQ(s.reference_message.posture_valid, 0) << "the end asks for nothing";
}

TEST(PlannedRun, IsRefusedWithoutAPlanFromHere) {
  Planned planned;
  EXPECT_NE(planned.ask().reason.find("has not been checked as feasible"), std::string::npos);
  planning_service::Plan plan = planned.plan();
  plan.trajectory += " ";
  planned.system.planning.onPlan(plan);
  EXPECT_NE(planned.ask().reason.find("has not been checked as feasible"), std::string::npos);
  plan = planned.plan();
  plan.start[9] += 0.1;
  planned.system.planning.onPlan(plan);
  const dds::Reply away = planned.ask();
  EXPECT_EQ(static_cast<dds::ReplyCode>(away.code), dds::ReplyCode::kWrongState);
  EXPECT_NE(away.reason.find("from other joints than the present ones of arm_b"), std::string::npos) << away.reason;
  planned.start.planned = 0;
  EXPECT_EQ(planned.ask().accepted, 1) << "without joints it is a run like any other";
  planned.system.run(0.5);
  EXPECT_EQ(planned.system.reference_message.posture_valid, 0);
}

TEST(PlannedRun, APostureThatNoLimitsAllowIsLeftOut) {
  Planned planned;
  planning_service::Plan plan = planned.plan();
  for (safety::RobotVector& q : plan.points)
    q[0] = 0.5;  // beyond the entry point
  planned.system.planning.onPlan(plan);
  ASSERT_EQ(planned.ask().accepted, 1);
  System& s = planned.system;
  const double before = s.state.position[0];
  s.run(0.9);
  EXPECT_EQ(s.reference_message.posture_valid, 1);
  EXPECT_EQ(s.drives(0), safety::OperatingState::kEnabled);
  EXPECT_NEAR(s.state.position[0], before, 0.005);
}

}  // namespace
}  // namespace tandem::test
