// SPDX-License-Identifier: Apache-2.0
/** @file Common core of hal and sim: checks commands, sessions and stops, and publishes the state of the drives. */
#pragma once

#include <utility>

#include "operation/convert.h"
#include "safety/command_monitor.h"
#include "services/dds/messages.h"
#include "services/runtime/drive_side.h"
#include "services/runtime/process.h"

namespace tandem::runtime {

/** Passes commands to the drives and their state to DDS messages. No function after construction allocates, locks or
 * throws. Times are ns. */
template <DriveSide Drives>
class DriveCore {
 public:
  void onStop() noexcept { drives_.stop(); }
  /// A process of another robot or deployment sends commands.
  void onMismatch() noexcept { drives_.stopPowered({bit(safety::Fault::kMismatch)}); }
  int armCount() const noexcept { return drives_.armCount(); }
  /// Cause of FAULT of an arm; empty in the other states.
  const safety::FaultRecord& faultRecord(int arm) const noexcept { return drives_.faultRecord(arm); }

 protected:
  template <class... Arguments>
  explicit DriveCore(const Setup& setup, Arguments&&... of_drives)
      : setup_(setup),
        lock_step_(setup.deployment.clock == config::ClockMode::kLockStep),
        drives_(std::forward<Arguments>(of_drives)...) {}

  /// Whether a command answers a state of this session.
  bool isOfThisSession(const dds::ActuationCommand& command) const noexcept {
    return command.state_session == setup_.session;
  }

  /// Converts a command for the drives. A command that answers no state of this session is infinitely old; in lock-step
  /// the others have age 0. @param arrivals  commands received so far, this one included; 0: not counted
  const safety::RobotCommand& read(const dds::ActuationCommand& from,
                                   std::int64_t now,
                                   std::uint64_t arrivals) noexcept {
    const bool ours = isOfThisSession(from);
    const double age = !ours ? safety::kUnlimited : lock_step_ ? 0.0 : stamps_.age(from.answers_state, now);
    command_.header = {.session = from.control_session,
                       .sequence = from.sequence,
                       .age = age,
                       .arm_count = from.arm_count,
                       .stamp = from.stamp,
                       .arrivals = arrivals};
    for (std::size_t k = 0; k < safety::kMaxArms; ++k) {
      const bool known = from.request[k] <= static_cast<std::uint8_t>(safety::DriveRequest::kRecover);
      command_.request[k] = known ? static_cast<safety::DriveRequest>(from.request[k]) : safety::DriveRequest::kKeep;
      command_.without[k] = from.without[k];
      command_.unseen[k] = false;
      command_.moving[k] = from.moving[k] != 0;
    }
    command_.velocity = from.velocity;
    command_.position = from.position;
    for (int k = 0; k < armCount(); ++k)
      ignoreClearOfUnseenFault(k, ours ? from.answers_state : 0);
    return command_;
  }

  /// The state to publish now, with a new sequence. @param stamp  `now`, or simulated time
  void show(std::int64_t now, std::int64_t stamp, dds::ActuationState& state) noexcept {
    state.session = setup_.session;
    state.sequence = ++sequence_;
    state.stamp = stamp_ = stamp;
    state.lock_step = lock_step_ ? 1 : 0;
    state.answers_command = drives_.answersCommand();
    state.joint_resets = drives_.jointResets();
    state.arm_count = static_cast<std::uint8_t>(armCount());
    for (int k = 0; k < armCount(); ++k) {
      showArm(k, state);
      reported_faults_.record(k, drives_.faults(k), sequence_);
    }
    stamps_.record(sequence_, now);
  }

  /// The status that belongs to the last published state: operating states, faults with their causes, and gate
  /// counters.
  void show(dds::HalStatus& status) const noexcept {
    status.session = setup_.session;
    status.sequence = sequence_;
    status.stamp = stamp_;
    status.arm_count = static_cast<std::uint8_t>(armCount());
    status.command_success = drives_.commandSuccess();
    status.emergency_stop = static_cast<std::uint8_t>(drives_.emergencyStop());
    for (int k = 0; k < armCount(); ++k) {
      status.operating_state[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(drives_.state(k));
      status.faults[static_cast<std::size_t>(k)] = drives_.faults(k);
      dds::setFaultRecord(drives_.faultRecord(k), k, status);
    }
    for (int g = 0; g < safety::kGuardCount; ++g) {
      const safety::GuardCounters::Entry& entry = drives_.guards()[static_cast<safety::Guard>(g)];
      const auto i = static_cast<std::size_t>(g);
      status.guard_count[i] = entry.count;
      status.guard_largest[i] = entry.largest;
      status.guard_arm[i] = static_cast<std::uint8_t>(entry.arm);
      status.guard_joint[i] = static_cast<std::uint8_t>(entry.joint);
    }
  }

  const Setup& setup_;
  bool lock_step_;
  Drives drives_;
  std::uint64_t sequence_ = 0;  ///< of the last published state
  std::int64_t stamp_ = 0;      ///< likewise

 private:
  /// Removes a `disable`, or marks a `recover`, that would clear a fault which its sender cannot have received yet.
  void ignoreClearOfUnseenFault(int arm, std::uint64_t answers_state) noexcept {
    safety::DriveRequest& request = command_.request[static_cast<std::size_t>(arm)];
    if (drives_.state(arm) != safety::OperatingState::kFault)
      return;
    const bool seen = reported_faults_.seen(arm, drives_.faults(arm), answers_state);
    if (request == safety::DriveRequest::kRecover)
      command_.unseen[static_cast<std::size_t>(arm)] = !seen;
    else if (request == safety::DriveRequest::kDisable && seen)
      reported_faults_.forget(arm);
    else if (request == safety::DriveRequest::kDisable)
      request = safety::DriveRequest::kKeep;
  }

  void showArm(int arm, dds::ActuationState& state) const noexcept {
    const auto i = static_cast<std::size_t>(arm);
    state.joint_count[i] = static_cast<std::uint8_t>(drives_.jointCount(arm));
    state.valid[i] = drives_.valid(arm) ? 1 : 0;
    state.holds[i] = drives_.holdsWithoutPower(arm) ? 1 : 0;
    state.operating_state[i] = static_cast<std::uint8_t>(drives_.state(arm));
    state.faults[i] = drives_.faults(arm);
    state.recovery[i] = drives_.recovering(arm) ? 1 : 0;
    state.lost[i] = drives_.lost(arm);
    state.homed[i] = drives_.homed(arm) ? 1 : 0;
    const safety::ArmVector position = drives_.position(arm), velocity = drives_.velocity(arm);
    const safety::ArmVector& setpoint = drives_.setpoint(arm);
    for (int j = 0; j < drives_.jointCount(arm); ++j) {
      const auto joint = dds::jointIndex(arm, j);
      state.position[joint] = position[j];
      state.velocity[joint] = velocity[j];
      state.setpoint[joint] = setpoint[j];
    }
  }

  safety::StateStamps stamps_;
  safety::ReportedFaults reported_faults_;
  safety::RobotCommand command_;
};

}  // namespace tandem::runtime
