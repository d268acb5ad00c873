// SPDX-License-Identifier: Apache-2.0
/** @file Robot, deployment and models shared by the parts of operation/. */
#pragma once

#include "config/config.h"
#include "robots/robot_model.h"

namespace tandem::operation {

/** Files and models; they outlive every ControlSetup. */
struct ControlSetup {
  const config::Deployment& deployment;
  const config::Robot& robot;
  const robots::RobotModel& model;
  std::uint64_t session = 0;          ///< of control, new with every start
  std::int64_t (*clock)() = nullptr;  ///< monotonic, ns; for the duration of steps

  bool lockStep() const noexcept { return deployment.clock == config::ClockMode::kLockStep; }
  double period() const noexcept { return deployment.control_period; }
  int arms() const noexcept { return model.armCount(); }
  const safety::ArmLimits& limits(int arm) const noexcept { return *model.limits()[static_cast<std::size_t>(arm)]; }
  /// Segment of one arm in a vector of all joints.
  template <class Vector>
  auto of(int arm, Vector& all) const noexcept {
    return all.segment(model.offset(arm), model.size(arm));
  }
};

}  // namespace tandem::operation
