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

  /// Compares what the drives say with what was asked for.
  void onState(bool restarted) noexcept;
  /// What judge() allows. @param without  recover: joints that shall not be used
  void apply(safety::StateCommand command, int arm, safety::JointMask without, std::int64_t now) noexcept;
  void latch(int arm, const safety::FaultRecord& record) noexcept;
  /// Latches all arms. A stop is news to whoever clears faults, even to who has seen one before.
  void stop() noexcept;
  /// All arms that may move.
  void latchMoving(const safety::FaultRecord& record) noexcept;
  /// An order has enabled these arms: while one of them waits for its power, a fault of it takes the power from all.
  void enabledTogether(int first, int last) noexcept;
  /// Takes that power.
  void resolveGroupEnable() noexcept;
  /// Drives that do not give the power that was asked for shall not give it later, when nobody thinks of it any more.
  void giveUpPending(std::int64_t now) noexcept;
  /** Torque does not stay for ever: an arm that nobody commands loses it, if it stays where it is without power.
   * @param decisions  what came of it in this cycle */
  void watchIdle(bool commanded,
                 std::int64_t now,
                 std::array<safety::IdlePower::Decision, safety::kMaxArms>& decisions) noexcept;

  /// Control wants the arm ENABLED.
  bool mayMove(int arm) const noexcept { return at(arm).machine.mayMove(); }
  /// So do the drives, as far as is known.
  bool powered(int arm) const noexcept { return mayMove(arm) && !at(arm).pending; }
  /// An arm has no power, or is about to lose it.
  bool anyWithoutPower() const noexcept;
  /// The arm has, or is about to have, power to be recovered.
  bool recovering(int arm) const noexcept;
  /// Text for people.
  safety::OperatingState shown(int arm) const noexcept;
  /// What led an arm into FAULT; empty in the other states.
  const safety::FaultRecord& record(int arm) const noexcept { return at(arm).record; }
  /// Whether who answers the control/status with this sequence knows of all faults of the arm.
  bool faultsSeen(int arm, std::uint64_t answers) const noexcept {
    return reported_faults_.seen(arm, at(arm).machine.faults(), answers);
  }
  safety::DriveRequest requestFor(int arm) const noexcept;
  /// Some drives have been asked for something that they do not yet show.
  bool hasPendingDriveRequest() const noexcept;

  void fill(int arm, ArmCondition& condition) const noexcept;
  void fill(msg::ActuationCommand& command) const noexcept;
  /// @param status  with its sequence
  void fill(msg::ControlStatus& status) noexcept;

 private:
  struct Arm {
    safety::StateMachine machine;
    safety::FaultRecord record;
    bool pending = false;             ///< enable or resume was asked for and the drives do not show it yet
    bool recovering = false;          ///< power was asked for to recover the arm
    safety::JointMask without = 0;    ///< recovering: joints that shall not be used
    std::int64_t pending_until = 0;   ///< given up then: power does not come because somebody once asked, ns
    std::uint64_t ignored_until = 0;  ///< faults in states older than the answer to this command are history
    std::uint64_t power_command = 0;  ///< the first command that asks for what is pending
    unsigned together = 0;            ///< enabled by one order: bits of arms
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
