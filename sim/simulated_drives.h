// SPDX-License-Identifier: Apache-2.0
/** @file Simulated drives of all arms, in real time and in lock-step. */
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "safety/arm_supervisor.h"
#include "safety/command_monitor.h"
#include "safety/emergency_stop.h"
#include "safety/robot_command.h"
#include "sim/simulated_arm.h"

namespace tandem::sim {

/** Options of SimulatedDrives. */
struct SimulatedDrivesOptions {
  double control_period = 0.1;  ///< T: commands come this often, s
  bool lock_step = false;       ///< ideal joints, one advance() per command
  safety::Budgets budgets;
  double following_error_translation = 0.5e-3;  ///< a drive fails when its joint is this far from its reference, m
  double following_error_rotation = 0.02;       ///< rad
  double translation_acceleration = safety::kUnlimited;  ///< of the plant, in real time, m/s^2
  double rotation_acceleration = safety::kUnlimited;     ///< rad/s^2
  double shortest_step = 1e-3;                           ///< of step(), s; in lock-step the control period
  JointMechanics mechanics;                              ///< of every joint
  EncoderOptions encoders;
  std::uint64_t seed = 1;  ///< of the encoders' noise
};

using Command = safety::RobotCommand;

/** Result of a reset. */
enum class ResetResult : std::uint8_t {
  kDone = 0,
  kMoving,         ///< an arm still moves
  kEnabled,        ///< an arm is ENABLED or PAUSED: disable it first
  kWrongSize,      ///< not as many joints as the robot has
  kOutsideLimits,  ///< a joint would be outside its limits
};
/// A sentence for people.
std::string_view describe(ResetResult result);

/** Plant, state machine, gate, ramps and watchdogs of all arms. One thread; nothing after construction allocates, locks
 * or throws. Times are ns on one clock of the caller: monotonic in real time, simulated in lock-step. */
class SimulatedDrives {
 public:
  /** @param start joint vectors inside the limits, m, rad
   * @throw std::invalid_argument where counts differ, a start is outside its limits or a period is not positive. */
  SimulatedDrives(const std::vector<safety::ArmLimits>& limits,
                  const std::vector<safety::ArmVector>& start,
                  const SimulatedDrivesOptions& options);

  /// Takes a command. False: refused by an integrity guard of the whole stream.
  bool command(const Command& command, std::int64_t now) noexcept;
  /// Real time: advances by dt, s, to the time `now`.
  void step(double dt, std::int64_t now) noexcept;
  /// Lock-step: one control period up to `now`; the joints are at their setpoints then.
  void advance(std::int64_t now) noexcept { step(options_.control_period, now); }
  /// The stop topic: stops every arm with the ramp and latches Fault::kStopRequested, in every state.
  void stop() noexcept;
  /// Likewise of the arms that have power.
  void stopPowered(const safety::FaultRecord& record) noexcept;
  /// Presses or releases the emergency stop: while it is pressed all arms are stopped and cannot be cleared.
  void setEmergencyStop(bool pressed) noexcept { emergency_stop_ = pressed; }
  safety::EmergencyStop emergencyStop() const noexcept {
    return emergency_stop_ ? safety::EmergencyStop::kPressed : safety::EmergencyStop::kReleased;
  }
  /// Puts all arms elsewhere (arms stacked, m, rad). Only while nothing moves and no arm is ENABLED or PAUSED.
  ResetResult reset(const safety::RobotVector& joints) noexcept;
  /// Share of the last 100 commands that came, 0 to 1.
  double commandSuccess() const noexcept { return monitor_.success(); }
  /// Times that it did.
  std::uint32_t jointResets() const noexcept { return joint_resets_; }
  /// Sets or ends the fault of one axis. False: no such axis.
  bool inject(int arm, int joint, AxisFault fault) noexcept;

  int armCount() const noexcept { return static_cast<int>(arms_.size()); }
  int jointCount(int arm) const noexcept { return arms_[arm].supervisor.limits().jointCount(); }
  /// Readings of the encoders, m, rad; NaN where an injected fault causes it.
  safety::ArmVector position(int arm) const noexcept { return arms_[arm].plant.reading(); }
  safety::ArmVector velocity(int arm) const noexcept { return arms_[arm].plant.velocityReading(); }
  bool valid(int arm) const noexcept { return arms_[arm].plant.valid(lost(arm)); }
  /// Without power an arm stays where it is: a simulated joint has friction and no weight.
  bool holdsWithoutPower(int /*arm*/) const noexcept { return true; }
  /// The last setpoint past the gate, m, rad.
  const safety::ArmVector& setpoint(int arm) const noexcept { return arms_[arm].supervisor.setpoint(); }
  /// Present reference of the joints, between two setpoints, m, rad.
  const safety::ArmVector& reference(int arm) const noexcept { return arms_[arm].supervisor.reference(); }
  safety::OperatingState state(int arm) const noexcept { return arms_[arm].supervisor.state(); }
  safety::FaultMask faults(int arm) const noexcept { return arms_[arm].supervisor.faults(); }
  /// ENABLED to be recovered, without the joints in lost().
  bool recovering(int arm) const noexcept { return arms_[arm].supervisor.recovering(); }
  safety::JointMask lost(int arm) const noexcept { return arms_[arm].supervisor.lost(); }
  /// All joints know where they are, always.
  bool homed(int /*arm*/) const noexcept { return true; }
  /// Cause of an arm's FAULT; empty in the other states.
  const safety::FaultRecord& faultRecord(int arm) const noexcept { return arms_[arm].supervisor.faultRecord(); }
  const SimulatedArm& plant(int arm) const noexcept { return arms_[arm].plant; }
  const safety::GuardCounters& guards() const noexcept { return guards_; }
  /// Neither a reference nor a joint moves.
  bool standing(int arm) const noexcept;
  bool standing() const noexcept;
  /// Sequence of the last command taken, 0 before the first.
  std::uint64_t answersCommand() const noexcept { return monitor_.sequence(); }

 private:
  struct Arm {
    safety::ArmSupervisor supervisor;
    SimulatedArm plant;
  };
  static safety::ArmVector positionsOf(const Arm& arm) noexcept;
  void checkSpeed(Arm& arm) const noexcept;
  void checkDrives(Arm& arm) const noexcept;
  void checkFollowing(Arm& arm) const noexcept;

  SimulatedDrivesOptions options_;
  safety::CommandMonitor monitor_;
  safety::GuardCounters guards_;
  std::vector<Arm> arms_;
  bool emergency_stop_ = false;
  std::uint32_t joint_resets_ = 0;
};

}  // namespace tandem::sim
