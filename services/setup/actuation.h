// SPDX-License-Identifier: Apache-2.0
/** @file What hal and sim share: actuation topics to and from whatever moves the joints. */
#pragma once

#include <atomic>
#include <optional>

#include "safety/gate.h"
#include "safety/robot_command.h"
#include "services/common/periodic_loop.h"
#include "services/dds/convert.h"
#include "services/dds/messages.h"
#include "services/setup/diagnostics.h"
#include "services/setup/fault_log.h"
#include "services/setup/process.h"

namespace tandem::service {

/// A command off the wire. @param age of the state that it answers, s; infinite where that is none of ours.
void readCommand(const dds::ActuationCommand& from, double age, safety::RobotCommand& command) noexcept;

/// Takes out of a command what would clear a fault that its sender cannot have seen.
template <class Robot>
void keepUnseenFaults(const Robot& robot,
                      std::uint64_t answers_state,
                      safety::ShownFaults& shown,
                      safety::RobotCommand& command) noexcept {
  for (int k = 0; k < robot.armCount(); ++k) {
    safety::DriveRequest& request = command.request[static_cast<std::size_t>(k)];
    const bool clears = request == safety::DriveRequest::kDisable || request == safety::DriveRequest::kRecover;
    if (!clears || robot.state(k) != safety::OperatingState::kFault)
      continue;
    const bool seen = shown.seen(k, answers_state);
    if (request == safety::DriveRequest::kRecover)
      command.unseen[static_cast<std::size_t>(k)] = !seen;
    else if (seen)
      shown.forget(k);
    else
      request = safety::DriveRequest::kKeep;
  }
}

/// Notes what a state that is about to be published shows.
inline void recordFaults(const dds::ActuationState& state, safety::ShownFaults& shown) noexcept {
  for (int k = 0; k < state.arm_count; ++k) {
    const auto drives = static_cast<safety::OperatingState>(state.operating_state[static_cast<std::size_t>(k)]);
    shown.record(k, drives == safety::OperatingState::kFault, state.sequence);
  }
}

/** All arms as `robot` (a SimulatedDrives or a RobotHardware) shows them. Session, sequence and stamp are the caller's.
 */
template <class Robot>
void writeState(const Robot& robot, dds::ActuationState& state) noexcept {
  state.answers_command = robot.answersCommand();
  state.arm_count = static_cast<std::uint8_t>(robot.armCount());
  for (int k = 0; k < robot.armCount(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    state.joint_count[i] = static_cast<std::uint8_t>(robot.jointCount(k));
    state.valid[i] = robot.valid(k) ? 1 : 0;
    state.holds[i] = robot.holdsWithoutPower(k) ? 1 : 0;
    state.operating_state[i] = static_cast<std::uint8_t>(robot.state(k));
    state.faults[i] = robot.faults(k);
    state.recovery[i] = robot.recovering(k) ? 1 : 0;
    state.lost[i] = robot.lost(k);
    state.homed[i] = robot.homed(k) ? 1 : 0;
    const safety::ArmVector position = robot.position(k), velocity = robot.velocity(k);
    const safety::ArmVector& setpoint = robot.setpoint(k);
    for (int j = 0; j < robot.jointCount(k); ++j) {
      const auto joint = dds::jointIndex(k, j);
      state.position[joint] = position[j];
      state.velocity[joint] = velocity[j];
      state.setpoint[joint] = setpoint[j];
    }
  }
}

/// Operating states, faults with what led to them, and what the gate did.
template <class Robot>
void writeStatus(const Robot& robot, dds::HalStatus& status) noexcept {
  status.arm_count = static_cast<std::uint8_t>(robot.armCount());
  status.emergency_stop = static_cast<std::uint8_t>(robot.emergencyStop());
  for (int k = 0; k < robot.armCount(); ++k) {
    status.operating_state[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(robot.state(k));
    status.faults[static_cast<std::size_t>(k)] = robot.faults(k);
    dds::setFaultRecord(robot.faultRecord(k), k, status);
  }
  for (int g = 0; g < safety::kGuardCount; ++g) {
    const safety::GuardCounters::Entry& entry = robot.guards()[static_cast<safety::Guard>(g)];
    const auto i = static_cast<std::size_t>(g);
    status.guard_count[i] = entry.count;
    status.guard_largest[i] = entry.largest;
    status.guard_arm[i] = static_cast<std::uint8_t>(entry.arm);
    status.guard_joint[i] = static_cast<std::uint8_t>(entry.joint);
  }
}

/// What a reader leaves of the last report on topic emergency_stop for the periodic thread; 0: nothing new.
inline constexpr std::uint8_t kReleasedReport = 1, kPressedReport = 2;
/// Listens to it if the deployment asks for it. @param told  outlives the reader
std::optional<dds::Reader> listenForEmergencyStop(dds::Bus& bus, const Setup& setup, std::atomic<std::uint8_t>& told);

/// What the loop measured of itself.
void writeLoop(const PeriodicLoop& loop, dds::HalStatus& status) noexcept;

/// The service's line on `diagnostics`, with `more` behind it. For publisher threads.
void diagnose(Diagnostics& diagnostics,
              const config::Robot& robot,
              const dds::HalStatus& status,
              std::vector<std::pair<std::string, std::string>> more = {});

}  // namespace tandem::service
