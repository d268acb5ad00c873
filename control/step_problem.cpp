// SPDX-License-Identifier: Apache-2.0
#include "control/step_problem.h"

#include <algorithm>

namespace tandem::control {

void StepProblem::setLimits(const safety::ArmLimits* const* limits, int count) {
  arm_count = count;
  joint_count = 0;
  row_count = 0;
  task_count = 0;
  barrier_count = 0;
  posture.resize(0);
  for (int k = 0; k < count; ++k) {
    const safety::ArmLimits& arm = *limits[k];
    arm_offset[k] = joint_count;
    for (int j = 0; j < arm.jointCount(); ++j) {
      const safety::JointLimit& limit = arm.joints[j];
      JointState& state = joint[joint_count + j];
      state = JointState{};
      state.kind = limit.kind;
      state.lower = limit.lower;
      state.upper = limit.upper;
      state.velocity = limit.velocity;
      state.approach_acceleration = limit.approach_acceleration;
    }
    for (const safety::LinearRow& row_limit : arm.rows) {
      CoupledRow& r = row[row_count];
      r.first = joint_count + row_limit.inner_joint;
      r.second = joint_count + row_limit.outer_joint;
      r.a_first = row_limit.a[row_limit.inner_joint];
      r.a_second = row_limit.a[row_limit.outer_joint];
      r.approach_acceleration = row_limit.approach_acceleration;
      row_bound_[row_count] = row_limit.b;
      ++row_count;
    }
    joint_count += arm.jointCount();
  }
  arm_offset[count] = joint_count;
}

void StepProblem::setPosition(const RobotVector& q) {
  for (int j = 0; j < joint_count; ++j) {
    JointState& state = joint[j];
    state.position = q[j];
    state.frozen_lower = state.moving_lower = state.lower;
    state.frozen_upper = state.moving_upper = state.upper;
  }
  for (int i = 0; i < row_count; ++i) {
    CoupledRow& r = row[i];
    r.gap = row_bound_[i] - (r.a_first * q[r.first] + r.a_second * q[r.second]);
    // Interval of one carriage with the other one stationary. Equation (1) bounds the outer one by the inner one only.
    const double outer_edge = q[r.second] + r.gap / r.a_second;
    const double inner_edge = q[r.first] + r.gap / r.a_first;
    JointState& outer = joint[r.second];
    JointState& inner = joint[r.first];
    if (r.a_second < 0.0) {
      outer.frozen_lower = std::max(outer.frozen_lower, outer_edge);
      outer.moving_lower = std::max(outer.moving_lower, outer_edge);
      inner.moving_upper = std::min(inner.moving_upper, inner_edge);
    } else {
      outer.frozen_upper = std::min(outer.frozen_upper, outer_edge);
      outer.moving_upper = std::min(outer.moving_upper, outer_edge);
      inner.moving_lower = std::max(inner.moving_lower, inner_edge);
    }
  }
}

}  // namespace tandem::control
