// SPDX-License-Identifier: Apache-2.0
/** @file Test fixture: a robot loaded from files, with drives that respond immediately, late or not at all. */
#pragma once

#include <deque>
#include <memory>

#include "config/robot_files.h"
#include "operation/convert.h"
#include "operation/drive_exchange.h"
#include "planning/reference_tracker.h"
#include "safety/robot_command.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::test {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::uint64_t kDriveSession = 5;

/** The preset `laptop` at 100 Hz. */
struct Rig {
  config::Deployment deployment;
  config::Robot robot;
  robots::RobotModel model;

  Rig() : deployment(load()), robot(config::loadAnyRobot(deployment.robot)), model(robot) {}
  operation::ControlSetup setup() const {
    return {deployment, robot, model, 3, [] { return std::int64_t{0}; }};
  }
  std::int64_t period() const { return static_cast<std::int64_t>(1e9 * deployment.control_period); }
  std::unique_ptr<planning::ReferenceTracker> tracker() const {
    control::MethodParameters parameters = robot.parameters;
    parameters.period = deployment.control_period;
    return std::make_unique<planning::ReferenceTracker>(model.models(), model.limits(), control::Method::kNspqp,
                                                        parameters, planning::Gains{});
  }

 private:
  static config::Deployment load() {
    auto loaded = config::loadDeployment(std::string(TANDEM_PRESETS) + "/deployments/laptop.yaml");
    loaded.control_period = 0.01;
    return loaded;
  }
};

/** Drives at home, DISABLED; joints equal their setpoints. */
struct Drives {
  msg::ActuationState state;

  explicit Drives(const Rig& rig) : rig_(rig) {
    state.session = kDriveSession;
    state.sequence = 1;
    state.arm_count = static_cast<std::uint8_t>(rig.model.armCount());
    for (int k = 0; k < rig.model.armCount(); ++k) {
      const auto i = static_cast<std::size_t>(k);
      state.joint_count[i] = static_cast<std::uint8_t>(rig.model.size(k));
      state.valid[i] = state.homed[i] = state.holds[i] = 1;
      place(k, rig.robot.arms[i].home);
    }
  }
  void place(int arm, const safety::ArmVector& q) {
    for (int j = 0; j < q.size(); ++j)
      state.position[msg::jointIndex(arm, j)] = state.setpoint[msg::jointIndex(arm, j)] = q[j];
  }
  /// Executes a command, and returns the next state.
  void take(const msg::ActuationCommand& command) {
    using safety::DriveRequest;
    using safety::OperatingState;
    for (int k = 0; k < state.arm_count; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const auto to = [&](OperatingState next) { state.operating_state[i] = static_cast<std::uint8_t>(next); };
      switch (static_cast<DriveRequest>(command.request[i])) {
        case DriveRequest::kEnable:
        case DriveRequest::kResume:
          to(OperatingState::kEnabled);
          break;
        case DriveRequest::kRecover:
          to(OperatingState::kEnabled);
          state.recovery[i] = 1;
          state.faults[i] = 0;
          break;
        case DriveRequest::kPause:
          to(OperatingState::kPaused);
          break;
        case DriveRequest::kDisable:
          to(OperatingState::kDisabled);
          state.recovery[i] = 0;
          state.faults[i] = 0;
          break;
        case DriveRequest::kKeep:
          break;
      }
      for (int j = 0; j < state.joint_count[i]; ++j) {
        const auto joint = msg::jointIndex(k, j);
        state.setpoint[joint] += rig_.deployment.control_period * command.velocity[joint];
        state.position[joint] = state.setpoint[joint];
      }
    }
    state.answers_command = command.sequence;
    ++state.sequence;
  }

 private:
  const Rig& rig_;
};

}  // namespace tandem::test
