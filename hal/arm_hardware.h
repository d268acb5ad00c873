// SPDX-License-Identifier: Apache-2.0
/** @file Hardware of one arm: connects safety::ArmSupervisor to the axes of the arm.
 *
 * Drives of an arm get torque together and lose it together. Torque never finds a distance to cover, one axis that
 * fails stops the arm along a line that keeps the coupled limits, and what the hardware did wrong is forgotten only by
 * a new boot of all nodes of the arm. */
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
  ArmHardware(const ArmConfig& config,
              std::vector<Axis*> axes,
              const safety::SupervisorOptions& options,
              double power_budget);

  /// Resets and configures all nodes of the arm.
  void boot(std::int64_t now) noexcept;

  /** Takes the arm's part of a command. A request to enable or to recover goes on until the drives are in operation;
   * one to disable an arm in FAULT boots the nodes first, where the hardware was the cause. To recover needs no boot:
   * joints against which something stands are lost, the others get power; where nothing is left, or a lost joint has
   * not been seen in good order since the start, nothing happens. */
  safety::GateReport command(const safety::ArmRequest& request, std::int64_t now) noexcept;
  void disableForNewSession() noexcept { supervisor_.disableForNewSession(); }
  /** The emergency stop as it is read now. While it is pressed, or has been lost, the arm is stopped and cannot be
   * cleared; while it is not known the arm does not get power. An arm that is recovered may have lost the drive that
   * reported it before: then it has to be known that it is pressed. */
  void setEmergencyStop(bool pressed, bool lost, bool known) noexcept;
  /// The stop topic.
  void stop(const safety::FaultRecord& record) noexcept { supervisor_.latch(record); }

  /// Runs a homing run, or keeps it running: without a repetition within kHomingKeepAlive it is stopped.
  enum class HomingAnswer : std::uint8_t { kDone, kRunning, kNotDisabled, kNotReady };
  HomingAnswer home(std::int64_t now) noexcept;
  static constexpr double kHomingKeepAlive = 1.0;  ///< s

  /// Goes on by one period of dt, s: watches the axes, moves the reference, writes what the drives shall do.
  /// @param[out] began per joint: the guards that began to act.
  void step(double dt, std::int64_t now, std::array<GuardMask, safety::kMaxJointsPerArm>& began) noexcept;

  const safety::ArmSupervisor& supervisor() const noexcept { return supervisor_; }
  int jointCount() const noexcept { return static_cast<int>(axes_.size()); }
  const Axis& axis(int joint) const noexcept { return *axes_[static_cast<std::size_t>(joint)]; }
  ArmPower power() const noexcept { return power_; }
  bool homing() const noexcept { return homing_.running(); }
  /// All joints know where they are.
  bool homed() const noexcept;
  bool valid() const noexcept;
  /// Neither the reference nor, as far as the drives tell that can be received, a joint moves.
  bool standing() const noexcept;
  safety::ArmVector position() const noexcept;
  safety::ArmVector velocity() const noexcept;
  /// Faults whose cause stands now, with the first joint of them.
  safety::FaultRecord presentFailure() const noexcept;
  safety::FaultMask presentFaults() const noexcept { return presentFailure().faults; }
  /// The nodes are being booted on request of an operator, or will be as soon as torque is gone.
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
  void stepHoming(std::int64_t now) noexcept;
  safety::ArmVector places() const noexcept;
  /// Somebody else commands a bus of this arm.
  bool foreignMaster() const noexcept;
  template <class Condition>
  bool all(Condition&& condition) const noexcept;

  safety::ArmSupervisor supervisor_;
  std::vector<Axis*> axes_;
  HomingRun homing_;
  std::int64_t power_budget_;
  std::int64_t request_budget_;
  ArmPower power_ = ArmPower::kOff;
  bool recovering_ = false;      ///< power is, or is being, given to recover the arm
  safety::JointMask lost_ = 0;   ///< recovering_: joints without power
  safety::JointMask known_ = 0;  ///< joints that were seen in good order since the start
  safety::ArmVector trusted_;    ///< where, the last time, m, rad
  std::int64_t power_since_ = 0;
  std::int64_t stop_budget_ = 0;  ///< of the slowest axis, ns
  std::int64_t stood_ = 0;        ///< since when the reference of an arm that lost its power stands, 0: it does not
  std::int64_t enable_asked_ = 0;
  std::int64_t home_asked_ = 0;
  std::int64_t booted_ = 0;
  std::int64_t up_since_ = 0;  ///< rebooting_: all axes have been up, 0: not yet
  bool needs_boot_ = false;    ///< the hardware caused a fault: only a boot clears it
  bool rebooting_ = false;
  bool boot_due_ = false;  ///< rebooting_: the boot has not begun yet
  bool emergency_active_ = false;
  bool emergency_known_ = true;
  bool emergency_lost_ = false;
  bool without_emergency_stop_ = false;  ///< recovering_: it was lost before
  std::array<GuardMask, safety::kMaxJointsPerArm> seen_{};
};

}  // namespace tandem::hal
