// SPDX-License-Identifier: Apache-2.0
/** @file Operating states of the arms: requested by control, reported by the drives, and their transitions. */
#pragma once

#include "operation/drive_exchange.h"
#include "operation/permission.h"
#include "safety/command_monitor.h"
#include "safety/faults.h"
#include "safety/idle_power.h"
#include "safety/recovery.h"
#include "safety/robot_command.h"

namespace tandem::operation {

/** Power, faults and recovery of each arm. Nothing allocates, locks or throws. */
class ArmStates {
 public:
  /// Keeps `drives` by reference.
  ArmStates(const ControlSetup& setup, const DriveExchange& drives)
      : drives_(drives), arm_count_(setup.arms()), idle_(setup.deployment.idle_power_off) {}

  /// Compares the state of the drives with the requested one.
  void onState(bool restarted) noexcept;
  /// Applies a command that judge() allows. @param without  recover: joints not to be used
  void apply(safety::StateCommand command, int arm, safety::JointMask without, std::int64_t now) noexcept;
  void latch(int arm, const safety::FaultRecord& record) noexcept;
  /// Latches all arms. A stop counts as a new fault, also for clients that have received an earlier one.
  void stop() noexcept;
  /// Latches all arms that may move.
  void latchMoving(const safety::FaultRecord& record) noexcept;
  /// One request has enabled these arms: while one of them waits for its power, a fault of it removes the power of all.
  void enabledTogether(int first, int last) noexcept;
  /// Disables such a group after a fault.
  void resolveGroupEnable() noexcept;
  /// Latches a fault for drives that do not give the requested power in time, so that they do not give it later.
  void giveUpPending(std::int64_t now) noexcept;
  /** Automatic power-off: an arm without commands loses its power if it keeps its position without power.
   * @param decisions  of this cycle, per arm */
  void watchIdle(bool commanded,
                 std::int64_t now,
                 std::array<safety::IdlePower::Decision, safety::kMaxArms>& decisions) noexcept;

  /// The state of the arm in control is ENABLED.
  bool mayMove(int arm) const noexcept { return at(arm).machine.mayMove(); }
  /// The arm is ENABLED in control and, as far as is known, in the drives.
  bool powered(int arm) const noexcept { return mayMove(arm) && !at(arm).pending; }
  /// An arm has no power, or is about to lose it.
  bool anyWithoutPower() const noexcept;
  /// The arm has, or is about to have, power for recovery.
  bool recovering(int arm) const noexcept;
  /// Operating state for display: FAULT of control, otherwise the state of the drives.
  safety::OperatingState shown(int arm) const noexcept;
  /// First cause of the FAULT state of an arm; empty in the other states.
  const safety::FaultRecord& record(int arm) const noexcept { return at(arm).record; }
  /// Whether the sender that answers the control/status with this sequence has received all faults of the arm.
  bool faultsSeen(int arm, std::uint64_t answers) const noexcept {
    return reported_faults_.seen(arm, at(arm).machine.faults(), answers);
  }
  safety::DriveRequest requestFor(int arm) const noexcept;
  /// Whether some drives do not show a requested state yet.
  bool hasPendingDriveRequest() const noexcept;

  void fill(int arm, ArmCondition& condition) const noexcept;
  void fill(msg::ActuationCommand& command) const noexcept;
  /// @param status  with its sequence
  void fill(msg::ControlStatus& status) noexcept;

 private:
  struct Arm {
    safety::StateMachine machine;
    safety::FaultRecord record;
    bool pending = false;             ///< enable or resume is requested; the drives do not show it yet
    bool recovering = false;          ///< power is requested for recovery
    safety::JointMask without = 0;    ///< recovering: joints not to be used
    std::int64_t pending_until = 0;   ///< time-out of the pending request, ns
    std::uint64_t ignored_until = 0;  ///< ignore faults in states older than the answer to this command
    std::uint64_t power_command = 0;  ///< the first command with the pending request
    unsigned together = 0;            ///< arms enabled by the same request, one bit per arm
  };
  const Arm& at(int arm) const noexcept { return arms_[static_cast<std::size_t>(arm)]; }
  Arm& at(int arm) noexcept { return arms_[static_cast<std::size_t>(arm)]; }
  void compare(int arm) noexcept;

  const DriveExchange& drives_;
  int arm_count_;
  safety::IdlePower idle_;
  safety::ReportedFaults reported_faults_;
  std::array<Arm, safety::kMaxArms> arms_;
};

}  // namespace tandem::operation
