// SPDX-License-Identifier: Apache-2.0
/** @file Hardware of one arm: connects safety::ArmSupervisor to the axes of the arm.
 *
 * All drives of an arm get torque together and lose it together. A drive gets torque with its target at the measured
 * position, so it does not move. If one axis fails, the arm stops along a line that keeps the coupled limits. Only a
 * new boot of all nodes of the arm clears a fault that the hardware caused. */
#pragma once

#include <vector>

#include "hal/axis.h"
#include "hal/homing_run.h"
#include "idl/enumerations.h"
#include "safety/arm_supervisor.h"
#include "safety/emergency_stop.h"

namespace tandem::hal {

using idl::ArmPower;
using idl::name;

/** Supervisor and axes of one arm. Nothing after construction allocates, locks or throws. Times are ns. */
class ArmHardware {
 public:
  /// @param axes one per joint, in order; they outlive the arm. @param power_budget s to bring all into operation.
  /// @param period  of step(), s
  ArmHardware(const ArmConfig& config,
              std::vector<Axis*> axes,
              const safety::SupervisorOptions& options,
              double power_budget,
              double period);

  /// Resets and configures all nodes of the arm.
  void boot(std::int64_t now) noexcept;

  /** Applies the part of a command for this arm. A request to enable or to recover continues until the drives are in
   * operation. A request to disable an arm in FAULT boots the nodes first if the hardware caused the fault. Recovery
   * needs no boot: joints that the request names, that have a guard or are not ready are lost, the others get power. It
   * has no effect if no joint is left, or if a lost joint has had no valid position since the start. */
  safety::GateReport command(const safety::ArmRequest& request, std::int64_t now) noexcept;
  void disableForNewSession() noexcept { supervisor_.disableForNewSession(); }
  /** Present state of the emergency stop. While it is pressed or lost, the arm is stopped and its fault cannot be
   * cleared; while its state is not known, the arm does not get power. A recovered arm may have lost the drive that
   * reported the emergency stop before: then only a known pressed state stops it. */
  void setEmergencyStop(bool pressed, bool lost, bool known) noexcept;
  /// Stop request from the stop topic.
  void stop(const safety::FaultRecord& record) noexcept { supervisor_.latch(record); }

  /** Starts a homing run, or continues it; the run stops unless the call is repeated within kHomingKeepAlive. If axes
   * are Axis::unconfirmed(), kUnconfirmed; a call that is repeated in this way for kConfirmTime confirms their
   * positions. */
  enum class HomingAnswer : std::uint8_t { kDone, kRunning, kNotDisabled, kNotReady, kUnconfirmed, kUnmeasured };
  HomingAnswer home(std::int64_t now) noexcept;
  /// Axis::takeMeasurement(), for an arm that is DISABLED and without power.
  MeasurementAnswer takeMeasurement(int joint, double position) noexcept {
    return off() && !homing() ? axes_[static_cast<std::size_t>(joint)]->takeMeasurement(position)
                              : MeasurementAnswer::kNotDisabled;
  }
  static constexpr double kHomingKeepAlive = 1.0;  ///< s
  static constexpr double kConfirmTime = 3.0;      ///< s

  /// Advances by one period of dt, s: checks the axes, moves the reference, writes the commands of the drives.
  /// @param[out] began per joint: the guards that became active.
  void step(double dt, std::int64_t now, std::array<GuardMask, safety::kMaxJointsPerArm>& began) noexcept;

  const safety::ArmSupervisor& supervisor() const noexcept { return supervisor_; }
  int jointCount() const noexcept { return static_cast<int>(axes_.size()); }
  const Axis& axis(int joint) const noexcept { return *axes_[static_cast<std::size_t>(joint)]; }
  ArmPower power() const noexcept { return power_; }
  bool homing() const noexcept { return homing_.running(); }
  /// All joints have a known position.
  bool homed() const noexcept;
  bool valid() const noexcept;
  /// The reference and all joints with a responding drive are at standstill.
  bool standing() const noexcept;
  safety::ArmVector position() const noexcept;
  safety::ArmVector velocity() const noexcept;
  /// Faults whose cause is present now, with the first joint that has one.
  safety::FaultRecord presentFailure() const noexcept;
  safety::FaultMask presentFaults() const noexcept { return presentFailure().faults; }
  /// An operator has requested a boot of the nodes: it is in progress, or starts as soon as torque is off.
  bool rebooting() const noexcept { return rebooting_; }

 private:
  safety::DriveRequest onEnable(std::int64_t now) noexcept;
  safety::DriveRequest onRecover(safety::JointMask without, std::int64_t now) noexcept;
  bool onceInOperation() noexcept;
  void startSwitchingOn(std::int64_t now) noexcept;
  bool lost(int joint) const noexcept { return (lost_ & safety::jointBit(joint)) != 0; }
  bool lost(const Axis& axis) const noexcept { return lost(axis.config().joint); }
  void notePositions() noexcept;
  void onDisable(std::int64_t now) noexcept;
  void watchAxes(std::int64_t now, std::array<GuardMask, safety::kMaxJointsPerArm>& began) noexcept;
  void onAxisGuards(int joint, GuardMask guards, std::int64_t now) noexcept;
  void latch(const safety::FaultRecord& record) noexcept;
  void stepPower(std::int64_t now) noexcept;
  void stepSwitchingOn(std::int64_t now) noexcept;
  void stepOn(std::int64_t now) noexcept;
  void switchOff(std::int64_t now) noexcept;
  void stepReboot(std::int64_t now) noexcept;
  /// DISABLED, and without power but for a homing run.
  bool off() const noexcept {
    return supervisor_.state() == safety::OperatingState::kDisabled && power_ == ArmPower::kOff;
  }
  void stepHoming(std::int64_t now) noexcept;
  void confirmPositions(bool again, std::int64_t now) noexcept;
  safety::ArmVector places() const noexcept;
  /// Another master commands a bus of this arm.
  bool foreignMaster() const noexcept;
  template <class Condition>
  bool all(Condition&& condition) const noexcept;

  safety::ArmSupervisor supervisor_;
  std::vector<Axis*> axes_;
  HomingRun homing_;
  std::int64_t power_budget_;
  std::int64_t request_budget_;
  ArmPower power_ = ArmPower::kOff;
  bool recovering_ = false;      ///< power is on, or is being switched on, to recover the arm
  safety::JointMask lost_ = 0;   ///< recovering_: joints without power
  safety::JointMask known_ = 0;  ///< joints that have had a valid position since the start
  safety::ArmVector trusted_;    ///< last valid position of these joints, m, rad
  std::int64_t power_since_ = 0;
  std::int64_t stop_budget_ = 0;  ///< stop budget of the slowest axis, ns
  std::int64_t stood_ = 0;        ///< before power goes off: start of the standstill of the reference; 0: none
  std::int64_t enable_asked_ = 0;
  std::int64_t home_asked_ = 0;
  std::int64_t confirming_ = 0;  ///< since when home() has been repeated, ns
  std::int64_t booted_ = 0;
  std::int64_t up_since_ = 0;  ///< rebooting_: time since which all axes are up, 0: not yet
  bool needs_boot_ = false;    ///< the hardware caused a fault: only a boot clears it
  bool rebooting_ = false;
  bool boot_due_ = false;  ///< rebooting_: the boot has not started yet
  bool emergency_active_ = false;
  bool emergency_known_ = true;
  bool emergency_pressed_ = false;
  bool emergency_lost_ = false;
  bool without_emergency_stop_ = false;  ///< recovering_: the emergency stop was lost before
  std::array<GuardMask, safety::kMaxJointsPerArm> seen_{};
};

}  // namespace tandem::hal
