// SPDX-License-Identifier: Apache-2.0
/** @file Robot hardware: all axes of all arms on all buses. */
#pragma once

#include <memory>
#include <vector>

#include "hal/arm_hardware.h"
#include "hal/emergency_stop.h"
#include "hal/event_ring.h"
#include "hal/fieldbus.h"
#include "safety/command_monitor.h"
#include "safety/robot_command.h"

namespace tandem::hal {

/** Options for running a robot. */
struct RobotOptions {
  double control_period = 0.1;  ///< T: period of the commands, s
  safety::Budgets budgets;
  double emergency_reports = 0.0;  ///< budget of onEmergencyStop(), s; 0: no such reports
};

/** Event for the log, in order of occurrence. */
struct HardwareEvent {
  enum class Kind : std::uint8_t {
    kGuard,        ///< `guards` became active on `arm`, `joint`
    kEmergency,    ///< `code` from the drive (or, `encoder`, the encoder) of that axis
    kNode,         ///< a device of that axis failed: `failure`
    kReady,        ///< that axis is ready
    kBus,          ///< `bus` entered `bus_state`
    kMaster,       ///< another master sends `master` on `bus`
    kReleased,     ///< the emergency stop is no longer pressed
    kUnconfirmed,  ///< the position of that axis after power on is not plausible: see `memory` and `position`
    kUnmeasured,   ///< the position of that axis has to be measured
  };
  Kind kind = Kind::kGuard;
  std::uint8_t arm = 0;
  std::uint8_t joint = 0;
  std::uint8_t bus = 0;
  bool encoder = false;
  std::uint16_t code = 0;
  GuardMask guards = 0;
  bool first_motion = false;                    ///< kGuard: before the axis has completed its first motion
  HomingFailure homing = HomingFailure::kNone;  ///< kGuard, with HardwareGuard::kHoming
  DeviceFailure failure;
  ProtectionMask lost = 0;  ///< kReady: protections that the drive lacks; kNode: those for which it is not used
  BusState bus_state = BusState::kActive;
  std::uint8_t master = 0;     ///< kMaster: FieldbusEvent::master
  PositionMemory memory{0.0};  ///< kUnconfirmed: the last position of the axis, or why there is none
  double position = 0.0;       ///< kUnconfirmed: the present one, m or rad
};

/** Periodic loop of the HAL: receive, check guards, compute targets, transmit.
 *
 * One thread; nothing after construction allocates, locks or throws. Times are ns on one monotonic clock. */
class RobotHardware {
 public:
  /** @param buses as in the configuration, open
   * @throw std::invalid_argument if counts differ or devices contradict each other. */
  RobotHardware(const HardwareConfig& config,
                std::vector<std::unique_ptr<Fieldbus>> buses,
                const RobotOptions& options);

  /// Before start(): receives and sends nothing. Repeat it for listeningTime(), then read bus(b).otherMasters(): do not
  /// start if there is another master.
  void listen(std::int64_t now) noexcept { receiveBuses(now); }
  /// The longest Fieldbus::listeningTime(), s.
  double listeningTime() const noexcept;
  /// Starts the buses and boots all devices.
  void start(std::int64_t now) noexcept;
  /// One period, config().period long.
  void step(std::int64_t now) noexcept;
  /// Applies a command. False: an integrity guard of the whole stream refused it.
  bool command(const safety::RobotCommand& command, std::int64_t now) noexcept;
  /// The stop topic: stops every arm with the ramp and latches Fault::kStopRequested, in every state.
  void stop() noexcept;
  /// The same for all arms that have power.
  void stopPowered(const safety::FaultRecord& record) noexcept;
  /// Report of another process that reads the emergency stop; to be repeated within the budget.
  void onEmergencyStop(bool pressed, std::int64_t now) noexcept { emergency_stop_.report(pressed, now); }
  /// No drive of any arm has torque, or is about to get it: the process may exit after stop().
  bool off() const noexcept;

  /// Homing of one arm; repeat the call within ArmHardware::kHomingKeepAlive until it is done.
  ArmHardware::HomingAnswer home(int arm, std::int64_t now) noexcept { return arms_[index(arm)].home(now); }

  /// The position of a joint, measured from outside, m or rad: see ArmHardware::takeMeasurement().
  MeasurementAnswer takeMeasurement(int arm, int joint, double position) noexcept {
    return arms_[index(arm)].takeMeasurement(joint, position);
  }

  /// Before start(): what is known of the last position of an axis, by its index in config().axes, m or rad.
  void restorePosition(std::size_t axis, LastPosition state, double position) noexcept {
    axes_[axis]->memory().restore(state, position);
  }
  /// Last positions that were known to be right.
  PositionSnapshot lastPositions() const noexcept;

  const HardwareConfig& config() const noexcept { return config_; }
  int armCount() const noexcept { return static_cast<int>(arms_.size()); }
  int jointCount(int arm) const noexcept { return arms_[index(arm)].jointCount(); }
  const ArmHardware& arm(int arm) const noexcept { return arms_[index(arm)]; }
  // Interface to control; the same names as in the simulated robot.
  safety::ArmVector position(int arm) const noexcept { return arms_[index(arm)].position(); }
  safety::ArmVector velocity(int arm) const noexcept { return arms_[index(arm)].velocity(); }
  bool valid(int arm) const noexcept { return arms_[index(arm)].valid(); }
  /// Every axis of the arm keeps its position without power, by its gear or its brake.
  bool holdsWithoutPower(int arm) const noexcept { return hal::holdsWithoutPower(config_, arm); }
  const safety::ArmVector& setpoint(int arm) const noexcept { return arms_[index(arm)].supervisor().setpoint(); }
  safety::OperatingState state(int arm) const noexcept { return arms_[index(arm)].supervisor().state(); }
  safety::FaultMask faults(int arm) const noexcept { return arms_[index(arm)].supervisor().faults(); }
  /// ENABLED for recovery, without the joints in lost().
  bool recovering(int arm) const noexcept { return arms_[index(arm)].supervisor().recovering(); }
  safety::JointMask lost(int arm) const noexcept { return arms_[index(arm)].supervisor().lost(); }
  /// All joints have a known position.
  bool homed(int arm) const noexcept { return arms_[index(arm)].homed(); }
  /// Cause of the state FAULT of an arm; empty in the other states.
  const safety::FaultRecord& faultRecord(int arm) const noexcept {
    return arms_[index(arm)].supervisor().faultRecord();
  }
  /// As read from the inputs of the hardware file.
  safety::EmergencyStop emergencyStop() const noexcept { return emergency_stop_.state(); }
  /// Number of joint resets: an axis gets a new known position without a motion.
  std::uint32_t jointResets() const noexcept { return joint_resets_; }
  bool standing() const noexcept;
  const safety::GuardCounters& guards() const noexcept { return guards_; }
  const HardwareGuardCounters& hardwareGuards() const noexcept { return hardware_guards_; }
  /// Sequence of the last accepted command, 0 before the first.
  std::uint64_t answersCommand() const noexcept { return monitor_.sequence(); }
  /// Share of the last 100 commands that were received, 0 to 1.
  double commandSuccess() const noexcept { return monitor_.success(); }

  int busCount() const noexcept { return static_cast<int>(buses_.size()); }
  const Fieldbus& bus(int b) const noexcept { return *buses_[index(b)].bus; }
  /// Share of the last 100 samples that were received, 0 to 1, of the drive or encoder with the worst reception on this
  /// bus.
  double busSuccess(int b) const noexcept;
  /// An operator clears a fault while this bus is off: a thread other than the periodic one has to restart it. True
  /// once per request.
  bool takeRestart(int b) noexcept;

  /// Removes the oldest event. False: there is none.
  bool nextEvent(HardwareEvent& event) noexcept { return events_.pop(event); }

 private:
  struct BusSlot {
    std::unique_ptr<Fieldbus> bus;
    std::vector<std::size_t> axes;  ///< indices in axes_ of its axes, in the order of Fieldbus::addAxis()
    bool restart = false;
  };
  static std::size_t index(int i) { return static_cast<std::size_t>(i); }
  /// A drive on this bus moves or holds its joint.
  bool carriesMotion(int b) const noexcept;
  void receiveBuses(std::int64_t now) noexcept;
  void receive(std::int64_t now) noexcept;
  void onEvent(std::size_t bus, const FieldbusEvent& event) noexcept;
  void watchEmergencyStop(std::int64_t now) noexcept;
  void reportReference(std::size_t axis) noexcept;
  void askForRestarts() noexcept;

  HardwareConfig config_;
  safety::CommandMonitor monitor_;
  safety::GuardCounters guards_;
  HardwareGuardCounters hardware_guards_;
  std::vector<BusSlot> buses_;
  std::vector<std::unique_ptr<Axis>> axes_;
  std::vector<ArmHardware> arms_;
  EmergencyStopWatch emergency_stop_;
  std::vector<AxisPhase> phases_;  ///< as last reported
  std::uint32_t joint_resets_ = 0;
  std::array<GuardMask, safety::kMaxJointsPerArm> began_{};
  EventRing<HardwareEvent, 128> events_;
};

}  // namespace tandem::hal
