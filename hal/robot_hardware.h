// SPDX-License-Identifier: Apache-2.0
/** @file Robot hardware: all axes of all arms on all buses. */
#pragma once

#include <memory>
#include <vector>

#include "hal/arm_hardware.h"
#include "hal/can/bus.h"
#include "hal/emergency_stop.h"
#include "hal/event_ring.h"
#include "safety/command_monitor.h"
#include "safety/robot_command.h"

namespace tandem::hal {

/** How a robot is run. */
struct RobotOptions {
  double control_period = 0.1;  ///< T: commands come this often, s
  safety::Budgets budgets;
  double emergency_reports = 0.0;  ///< budget of onEmergencyStop(), s; 0: nobody is asked
};

/** Something to tell people, in the order of happening. */
struct HardwareEvent {
  enum class Kind : std::uint8_t {
    kGuard,      ///< `guards` began on `arm`, `joint`
    kEmergency,  ///< `code` from the drive (or, `encoder`, the encoder) of that axis
    kNode,       ///< a node of that axis failed: `failure`
    kReady,      ///< that axis can be used
    kBus,        ///< `bus` entered `bus_state`
    kMaster,     ///< somebody else sends `master` on `bus`
    kReleased,   ///< the emergency stop is no longer pressed
  };
  Kind kind = Kind::kGuard;
  std::uint8_t arm = 0;
  std::uint8_t joint = 0;
  std::uint8_t bus = 0;
  bool encoder = false;
  std::uint16_t code = 0;
  GuardMask guards = 0;
  canopen::NodeFailure failure;
  can::BusState bus_state = can::BusState::kActive;
  canopen::MasterFrame master = canopen::MasterFrame::kSync;
};

/** One period: what was received, what is wrong, where the arms shall be, what is sent, SYNC last.
 *
 * One thread; nothing after construction allocates, locks or throws. Times are ns on one monotonic clock. */
class RobotHardware {
 public:
  /** @param buses as in the configuration, open; they outlive the robot
   * @throw std::invalid_argument where counts differ or nodes contradict each other. */
  RobotHardware(const HardwareConfig& config, const std::vector<can::Bus*>& buses, const RobotOptions& options);

  /// Before start(): takes in what is on the buses and sends nothing. Repeat it for listeningTime(), then look at
  /// network(b).masters(): whoever finds somebody there must not start.
  void listen(std::int64_t now) noexcept { receiveFrames(now); }
  /// canopen::listeningTime() of the drives' time-out, s.
  double listeningTime() const noexcept { return listening_time_; }
  /// Begins to send heartbeats and boots all nodes.
  void start(std::int64_t now) noexcept;
  /// One period, config().period long.
  void step(std::int64_t now) noexcept;
  /// Takes a command. False: refused by an integrity guard of the whole stream.
  bool command(const safety::RobotCommand& command, std::int64_t now) noexcept;
  /// The stop topic: stops every arm with the ramp and latches Fault::kStopRequested, in every state.
  void stop() noexcept;
  /// Likewise of the arms that have power.
  void stopPowered(const safety::FaultRecord& record) noexcept;
  /// What somebody says who reads the emergency stop elsewhere; to be repeated within the budget.
  void onEmergencyStop(bool pressed, std::int64_t now) noexcept { emergency_stop_.report(pressed, now); }
  /// No drive of any arm has torque, or is about to get it: the moment to leave after stop().
  bool off() const noexcept;

  /// Homing of one arm; repeat it within ArmHardware::kHomingKeepAlive until it is done.
  ArmHardware::HomingAnswer home(int arm, std::int64_t now) noexcept { return arms_[index(arm)].home(now); }

  const HardwareConfig& config() const noexcept { return config_; }
  int armCount() const noexcept { return static_cast<int>(arms_.size()); }
  int jointCount(int arm) const noexcept { return arms_[index(arm)].jointCount(); }
  const ArmHardware& arm(int arm) const noexcept { return arms_[index(arm)]; }
  // As control sees an arm; the same names as of the simulated robot.
  safety::ArmVector position(int arm) const noexcept { return arms_[index(arm)].position(); }
  safety::ArmVector velocity(int arm) const noexcept { return arms_[index(arm)].velocity(); }
  bool valid(int arm) const noexcept { return arms_[index(arm)].valid(); }
  /// Without power every axis of the arm stays where it is, by its gear or its brake.
  bool holdsWithoutPower(int arm) const noexcept { return hal::holdsWithoutPower(config_, arm); }
  const safety::ArmVector& setpoint(int arm) const noexcept { return arms_[index(arm)].supervisor().setpoint(); }
  safety::OperatingState state(int arm) const noexcept { return arms_[index(arm)].supervisor().state(); }
  safety::FaultMask faults(int arm) const noexcept { return arms_[index(arm)].supervisor().faults(); }
  /// ENABLED to be recovered, without the joints in lost().
  bool recovering(int arm) const noexcept { return arms_[index(arm)].supervisor().recovering(); }
  safety::JointMask lost(int arm) const noexcept { return arms_[index(arm)].supervisor().lost(); }
  /// All joints know where they are.
  bool homed(int arm) const noexcept { return arms_[index(arm)].homed(); }
  /// What led an arm into FAULT; empty in the other states.
  const safety::FaultRecord& faultRecord(int arm) const noexcept {
    return arms_[index(arm)].supervisor().faultRecord();
  }
  /// As the inputs of the hardware file tell it.
  safety::EmergencyStop emergencyStop() const noexcept { return emergency_stop_.state(); }
  /// Times that an axis learnt where it is: its position before that is no part of a way.
  std::uint32_t jointResets() const noexcept { return joint_resets_; }
  bool standing() const noexcept;
  const safety::GuardCounters& guards() const noexcept { return guards_; }
  const HardwareGuardCounters& hardwareGuards() const noexcept { return hardware_guards_; }
  /// Sequence of the last command taken, 0 before the first.
  std::uint64_t answersCommand() const noexcept { return monitor_.sequence(); }
  /// Share of the last 100 commands that came, 0 to 1.
  double commandSuccess() const noexcept { return monitor_.success(); }

  int busCount() const noexcept { return static_cast<int>(buses_.size()); }
  const can::Bus& bus(int b) const noexcept { return *buses_[index(b)].bus; }
  const canopen::Network& network(int b) const noexcept { return *buses_[index(b)].network; }
  /// Share of the bit rate in use, from the frames of the last second at their longest.
  double busLoad(int b) const noexcept { return buses_[index(b)].load; }
  /// Share of the last 100 TPDOs that came, 0 to 1, of the drive or encoder on this bus with the worst reception.
  double busSuccess(int b) const noexcept;
  /// An operator clears a fault while this bus is off: somebody outside of the periodic thread shall restart it. True
  /// once per request.
  bool takeRestart(int b) noexcept;

  /// Takes the oldest event out. False: there is none.
  bool nextEvent(HardwareEvent& event) noexcept { return events_.pop(event); }

 private:
  struct BusSlot {
    can::Bus* bus = nullptr;
    std::unique_ptr<canopen::Network> network;
    std::vector<int> axis_of_node;  ///< index in axes_, by the network's index of the node
    bool restart = false;
    double load = 0.0;
    std::uint64_t frames = 0;  ///< at the beginning of the window
    std::int64_t window = 0;   ///< its beginning, ns
  };
  static std::size_t index(int i) { return static_cast<std::size_t>(i); }
  void receiveFrames(std::int64_t now) noexcept;
  void receive(std::int64_t now) noexcept;
  void onEvent(std::size_t bus, const canopen::NetworkEvent& event) noexcept;
  void watchEmergencyStop(std::int64_t now) noexcept;
  void measureLoad(BusSlot& slot, std::size_t bus, std::int64_t now) noexcept;
  void askForRestarts() noexcept;

  HardwareConfig config_;
  double listening_time_;
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
