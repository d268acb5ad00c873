// SPDX-License-Identifier: Apache-2.0
/** @file Test fixture: two arms on two simulated buses with a correct command stream, in simulated time. */
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <utility>

#include "config/config.h"
#include "hal/can/virtual_bus.h"
#include "hal/cia402/canopen_bus.h"
#include "hal/robot_hardware.h"
#include "services/drive_sim/bus_spec.h"
#include "sim/drives/drive_bus.h"

namespace tandem::hal::test {

using safety::ArmVector;
using safety::DriveRequest;
using safety::Fault;
using safety::OperatingState;
using sim::drives::FaultKind;

inline constexpr std::int64_t kMillisecond = 1'000'000;

inline HardwareConfig presetHardware() {
  HardwareConfig config =
      config::loadHardware(std::filesystem::path(TANDEM_SOURCE) / "config/presets/hardware/ark2024-two-buses.yaml");
  config.feedback_budget = HardwareConfig{}.feedback_budget;  // simulated time is never late
  for (AxisConfig& axis : config.axes) {
    axis.following_error = axis.translation ? 0.5e-3 : 0.05;
    axis.following_time = 0.02;
    axis.encoder->tolerance = axis.translation ? 0.2e-3 : 0.02;
  }
  return config;
}

inline HardwareConfig presetHardware(DriveMode mode) {
  HardwareConfig config = presetHardware();
  for (AxisConfig& axis : config.axes) {
    axis.mode = mode;
    if (!targetIsVelocity(mode))
      continue;
    axis.velocity_gain = 20.0;
    axis.following_error = axis.translation ? 1e-3 : 0.1;
  }
  return config;
}

/// Linear stages of arm A search their negative limit switch; all other joints keep their absolute encoders.
inline HardwareConfig homingHardware() {
  HardwareConfig config = presetHardware();
  constexpr double kHome[] = {-0.4, -0.3, -0.19};
  for (AxisConfig& axis : config.axes) {
    if (axis.arm != 0 || !axis.translation)
      continue;
    axis.reference = PositionReference::kHoming;
    axis.encoder.reset();
    axis.first_motion = kFirstTranslation;
    axis.homing.method = 17;
    axis.homing.fast = 0.01;
    axis.homing.slow = 0.002;
    axis.homing.acceleration = 0.2;
    axis.homing.position = kHome[axis.joint];
    axis.homing.budget = 60.0;
  }
  return config;
}

/// Equal velocities of all translations, m/s, and of all rotations, rad/s, of an arm.
inline ArmVector speeds(double translation, double rotation) {
  ArmVector v(6);
  v << translation, translation, translation, rotation, rotation, rotation;
  return v;
}

/** What the drives of a robot are, beside its hardware file. */
struct DriveKind {
  DriveKind(sim::drives::Eds sheet = sim::drives::driveEds(), const sim::drives::Habits& how = {})
      : eds(std::move(sheet)), habits(how) {}
  sim::drives::Eds eds;
  sim::drives::Habits habits;
  bool switches = true;  ///< false: no switch is fitted
  std::function<void(sim::drives::DriveSpec&)> adapt = [](sim::drives::DriveSpec&) {};
};

/** One bus with its drives, and the HAL's port on it. */
struct Wire {
  Wire(const HardwareConfig& hardware, int index, std::int64_t now, const DriveKind& kind = {})
      : master(bus.join("hal")), slaves(bus.join("drives")) {
    bus.now = now;
    sim::drives::BusSpec spec;
    spec.drive_eds = kind.eds;
    drive_sim::addNodes(hardware, hardware.buses[static_cast<std::size_t>(index)].name, spec);
    for (sim::drives::DriveSpec& drive : spec.drives) {
      drive.habits = kind.habits;
      if (!kind.switches) {
        drive.motor.low = -std::numeric_limits<double>::infinity();
        drive.motor.high = -drive.motor.low;
        drive.switches = {};
      }
      kind.adapt(drive);
    }
    drives = std::make_unique<sim::drives::DriveBus>(slaves, spec, now);
  }
  can::VirtualBus bus;
  can::VirtualBus::Port& master;
  can::VirtualBus::Port& slaves;
  std::unique_ptr<sim::drives::DriveBus> drives;
};

/** Drives, HAL and command source in lock-step. */
class System {
 public:
  static constexpr double kControlPeriod = 0.1;

  explicit System(const HardwareConfig& hardware = presetHardware(),
                  double emergency_reports = 0.0,
                  const DriveKind& kind = {})
      : config(hardware) {
    for (int b = 0; b < static_cast<int>(config.buses.size()); ++b)
      wires.push_back(std::make_unique<Wire>(config, b, now, kind));
    replaceHal(config, emergency_reports);
  }
  /// Drives of another kind, without a CAN bus.
  System(const HardwareConfig& hardware, std::vector<std::unique_ptr<Fieldbus>> buses) : config(hardware) {
    startHal(config, std::move(buses), 0.0);
  }

  /// A new HAL, by another hardware file perhaps, at the same drives.
  void replaceHal(const HardwareConfig& file, double emergency_reports = 0.0) {
    std::vector<can::Bus*> buses;
    for (auto& wire : wires)
      buses.push_back(&wire->master);
    startHal(file, canopenBuses(file, buses, safety::Budgets{}), emergency_reports);
  }
  void startHal(const HardwareConfig& file, std::vector<std::unique_ptr<Fieldbus>> buses, double emergency_reports) {
    RobotOptions options;
    options.control_period = kControlPeriod;
    options.emergency_reports = emergency_reports;
    robot = std::make_unique<RobotHardware>(file, std::move(buses), options);
  }

  /// One period of the bus: drives every millisecond, the HAL at the end, commands every control period.
  void period() {
    const auto ticks = static_cast<int>(std::lround(1e3 * config.period));
    for (int i = 0; i < ticks; ++i) {
      now += kMillisecond;
      for (auto& wire : wires) {
        wire->bus.now = now;
        wire->drives->poll(now);
      }
    }
    if (!hal_alive)
      return;
    if (commanding && now - last_command >= static_cast<std::int64_t>(1e9 * kControlPeriod)) {
      last_command = now;
      send();
    }
    robot->step(now);
    while (robot->nextEvent(event))
      events.push_back(event);
    if (after_period)
      after_period();
  }
  void run(double seconds) {
    const std::int64_t end = now + static_cast<std::int64_t>(1e9 * seconds);
    while (now < end)
      period();
  }
  /// Runs until the condition is met. @return whether it was within `seconds`.
  bool until(double seconds, const std::function<bool()>& condition) {
    const std::int64_t end = now + static_cast<std::int64_t>(1e9 * seconds);
    while (!condition()) {
      if (now >= end)
        return false;
      period();
    }
    return true;
  }

  bool boot() {
    robot->start(now);
    return until(5.0, [this] { return allHomed(); });
  }
  bool allHomed() const {
    for (int a = 0; a < robot->armCount(); ++a) {
      if (!robot->arm(a).homed())
        return false;
    }
    return true;
  }
  bool all(OperatingState state) const {
    for (int a = 0; a < robot->armCount(); ++a) {
      if (robot->state(a) != state)
        return false;
    }
    return true;
  }
  bool enable() {
    request(DriveRequest::kEnable);
    const bool done = until(3.0, [this] { return all(OperatingState::kEnabled); });
    request(DriveRequest::kKeep);
    return done;
  }
  void request(DriveRequest what) { command.request.fill(what); }
  /// From now on all joints of the arm move with these velocities, in every command.
  void move(int arm, const ArmVector& speed) { speeds[static_cast<std::size_t>(arm)] = speed; }
  void hold() { speeds = {}; }

  void send() {
    command.header.session = 7;
    command.header.sequence = ++sequence;
    command.header.age = 0.0;
    command.header.arm_count = robot->armCount();
    for (int a = 0; a < robot->armCount(); ++a) {
      const auto i = static_cast<std::size_t>(a);
      const bool moving = speeds[i].size() != 0;
      command.moving[i] = moving;
      for (int j = 0; j < robot->jointCount(a); ++j) {
        const auto k = static_cast<std::size_t>(a) * safety::kMaxJointsPerArm + static_cast<std::size_t>(j);
        command.velocity[k] = moving ? speeds[i][j] : 0.0;
        command.position[k] = robot->setpoint(a)[j] + kControlPeriod * command.velocity[k];
      }
    }
    accepted = robot->command(command, now);
  }

  bool inject(int bus, FaultKind kind, int node, double value = 0.0, double duration = 0.0) {
    return wires[static_cast<std::size_t>(bus)]->drives->inject(
        {kind, static_cast<std::uint8_t>(node), value, duration});
  }
  template <class Devices>
  static auto& find(Devices& devices, int id) {
    return *std::ranges::find_if(devices, [id](const auto& device) { return device->id() == id; });
  }
  sim::drives::Drive& drive(int arm, int joint) {
    const AxisConfig& axis = robot->arm(arm).axis(joint).config();
    return *find(wires[static_cast<std::size_t>(axis.bus)]->drives->drives(), axis.node);
  }
  /// True joint position, m or rad: by the encoder's gearing, independently of drive and HAL.
  double truth(int arm, int joint) {
    const AxisConfig& axis = robot->arm(arm).axis(joint).config();
    const auto read = [&] {
      return axis.hasEncoderNode()
                 ? find(wires[static_cast<std::size_t>(axis.bus)]->drives->encoders(), axis.encoder->node)->position()
                 : drive(arm, joint).load().position();
    };
    return AxisUnits(axis.encoder->gearing).toJoint(static_cast<std::int32_t>(std::lround(read())));
  }
  ArmVector truth(int arm) {
    ArmVector q(robot->jointCount(arm));
    for (int j = 0; j < robot->jointCount(arm); ++j)
      q[j] = truth(arm, j);
    return q;
  }
  std::uint64_t guardCount(HardwareGuard guard) const { return robot->hardwareGuards()[guard].count; }
  std::string story() const {
    std::string text;
    for (const HardwareEvent& e : events)
      text += "kind " + std::to_string(static_cast<int>(e.kind)) + " arm " + std::to_string(e.arm) + " joint " +
              std::to_string(e.joint) + " code " + std::to_string(e.code) + " guards " + describeGuards(e.guards) +
              " reason " + std::to_string(static_cast<int>(e.failure.reason)) + " step " +
              std::to_string(e.failure.step) + "\n";
    return text;
  }

  HardwareConfig config;
  std::int64_t now = 1'000'000'000;
  std::vector<std::unique_ptr<Wire>> wires;
  std::unique_ptr<RobotHardware> robot;
  safety::RobotCommand command;
  std::array<ArmVector, safety::kMaxArms> speeds;
  std::uint64_t sequence = 0;
  std::int64_t last_command = 0;
  bool commanding = true;
  bool hal_alive = true;
  bool accepted = false;
  std::vector<HardwareEvent> events;
  HardwareEvent event;
  std::function<void()> after_period;
};

/// The CANopen side of an axis and of a bus.
inline const canopen::Node& driveNode(const Axis& axis) {
  return dynamic_cast<const Cia402Driver&>(axis.driver()).driveNode();
}
inline const canopen::Network& networkOf(const RobotHardware& robot, int bus) {
  return dynamic_cast<const CanopenBus&>(robot.bus(bus)).network();
}

/// Repeats the request to home arm A until its run has ended, at most so many times.
inline ArmHardware::HomingAnswer homeArm(System& system, int most) {
  ArmHardware::HomingAnswer answer = system.robot->home(0, system.now);
  for (int i = 0; i < most && answer == ArmHardware::HomingAnswer::kRunning; ++i) {
    system.run(0.1);
    answer = system.robot->home(0, system.now);
  }
  return answer;
}

/// Reasons of the homing runs that failed, axis by axis.
inline std::vector<HomingFailure> homingFailures(const System& system) {
  std::vector<HomingFailure> reasons;
  for (const HardwareEvent& event : system.events) {
    if (event.kind == HardwareEvent::Kind::kGuard && (event.guards & bit(HardwareGuard::kHoming)) != 0)
      reasons.push_back(event.homing);
  }
  return reasons;
}

/// Moves all joints of the first arm for a second, and expects that they travel as commanded. The arm is ENABLED.
inline void expectMoves(System& system, double translation, double rotation) {
  constexpr double kTime = 1.0;
  const ArmVector start = system.truth(0);
  system.move(0, speeds(translation, rotation));
  system.run(kTime);
  system.hold();
  system.run(0.5);
  EXPECT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
  const ArmVector moved = system.truth(0) - start;
  for (int j = 0; j < 6; ++j)
    EXPECT_NEAR(moved[j] / (j < 3 ? translation : rotation), kTime, 0.2) << j;
}

}  // namespace tandem::hal::test
