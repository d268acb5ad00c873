// SPDX-License-Identifier: Apache-2.0
/** @file A request for a computation, and the robot that it is for. */
#pragma once

#include <string>

#include "services/computation/computation.h"
#include "tests/unit/services/system.h"

namespace tandem::test {

/// A line along z, m.
inline std::string lineOf(double z, int points = 5, int arm = 0) {
  planning::TrajectorySpec spec;
  spec.arm = arm;
  spec.name = "line";
  spec.shape = planning::Line{{0.0, 0.0, z}};
  spec.point_count = points;
  return config::formatTrajectory(spec);
}

/// A robot, and an accepted request.
struct ComputationFixture {
  explicit ComputationFixture(const std::string& deployment = "laptop")
      : setup(makeSetup(deployment)), model(setup.robot, setup.deployment.model) {
    std::vector<Eigen::VectorXd> stack;
    for (const config::Arm& arm : setup.robot.arms)
      stack.push_back(arm.home);
    home = model.stack(stack);
    request.client = 5;
    request.request = 9;
    request.kind = static_cast<std::uint8_t>(dds::ComputationKind::kCheck);
    request.trajectory = lineOf(0.01);
  }
  computation::ComputationRobot robot() const { return {setup.robot, model, setup.deployment.model == "rigid"}; }
  dds::ActuationState state(double outside = 0.0) const {
    dds::ActuationState state;
    state.session = state.sequence = 1;
    state.arm_count = 2;
    for (int k = 0; k < 2; ++k) {
      state.joint_count[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(model.size(k));
      state.valid[static_cast<std::size_t>(k)] = 1;
      for (int j = 0; j < model.size(k); ++j)
        state.position[dds::jointIndex(k, j)] = home[model.offset(k) + j];
    }
    for (const safety::LinearRow& row : model.limits()[0]->rows) {
      // Carriages nearer to each other than possible.
      if (outside > 0.0 && row.kind == safety::RowKind::kCarriageSpacing && row.inner_joint == 0)
        state.position[0] += (row.b + outside - safety::rowValue(row, home.head(model.size(0)))) / row.a[0];
    }
    return state;
  }
  /// Reason of the refusal; empty if accepted.
  std::string refusal(dds::ReplyCode& code) const {
    try {
      computation::Computation computation(request, robot(), home);
      return "";
    } catch (const computation::Refusal& why) {
      code = why.code();
      return why.what();
    }
  }

  runtime::Setup setup;
  robots::RobotModel model;
  safety::RobotVector home;
  dds::ComputationRequest request;
};

}  // namespace tandem::test
