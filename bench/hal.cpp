// SPDX-License-Identifier: Apache-2.0
/** @file Benchmark of one HAL cycle (two arms, two buses, 24 PDOs received, 12 PDOs and two SYNCs sent), compared
 * with the transmission time of the same frames at 1 Mbit/s. */
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>

#include "bench/enroll.h"
#include "bench/percentiles.h"
#include "config/config.h"
#include "hal/can/virtual_bus.h"
#include "hal/cia402/canopen_bus.h"
#include "hal/robot_hardware.h"
#include "sim/drives/drive_bus.h"

namespace tandem::bench {
namespace {

using safety::DriveRequest;
using safety::OperatingState;

constexpr std::int64_t kMillisecond = 1'000'000;
constexpr double kControlPeriod = 0.1;  // s

/// The drives and encoders of one bus, with the gears of the hardware file.
sim::drives::BusSpec specOf(const hal::HardwareConfig& hardware, int bus) {
  sim::drives::BusSpec spec;
  for (const hal::AxisConfig& axis : hardware.axes) {
    if (axis.bus != bus)
      continue;
    sim::drives::DriveSpec drive;
    drive.id = static_cast<std::uint8_t>(axis.node);
    spec.drives.push_back(drive);
    sim::drives::EncoderSpec encoder;
    encoder.id = static_cast<std::uint8_t>(axis.encoder->node);
    encoder.drive = drive.id;
    encoder.ratio = hal::AxisUnits(axis.gearing).scale() / hal::AxisUnits(axis.encoder->gearing).scale();
    spec.encoders.push_back(encoder);
  }
  return spec;
}

/** One bus with its drives and the HAL. */
struct Wire {
  Wire(const hal::HardwareConfig& hardware, int index, std::int64_t now)
      : master(bus.join("hal")), slaves(bus.join("drives")) {
    bus.now = now;
    drives = std::make_unique<sim::drives::DriveBus>(slaves, specOf(hardware, index), now);
  }
  hal::can::VirtualBus bus;
  hal::can::VirtualBus::Port& master;
  hal::can::VirtualBus::Port& slaves;
  std::unique_ptr<sim::drives::DriveBus> drives;
};

/** The robot in simulated time. */
class Robot {
 public:
  explicit Robot(const hal::HardwareConfig& hardware) : hardware_(hardware) {
    std::vector<hal::can::Bus*> buses;
    for (int b = 0; b < static_cast<int>(hardware_.buses.size()); ++b) {
      wires_.push_back(std::make_unique<Wire>(hardware_, b, now_));
      buses.push_back(&wires_.back()->master);
    }
    hal::RobotOptions options;
    options.control_period = kControlPeriod;
    robot_ =
        std::make_unique<hal::RobotHardware>(hardware_, hal::canopenBuses(hardware_, buses, options.budgets), options);
  }

  /// Boots, and enables both arms. @return whether they are enabled.
  bool enable() {
    robot_->start(now_);
    const auto homed = [this] { return robot_->arm(0).homed() && robot_->arm(1).homed(); };
    if (!until(homed))
      return false;
    command_.request.fill(DriveRequest::kEnable);
    const bool done = until([this] { return enabled(); });
    command_.request.fill(DriveRequest::kKeep);
    return done;
  }
  bool enabled() const {
    return robot_->state(0) == OperatingState::kEnabled && robot_->state(1) == OperatingState::kEnabled;
  }
  /// Everything but the HAL: the drives, and the command if one is due.
  void prepare() {
    for (auto left = std::lround(1e3 * hardware_.period); left > 0; --left) {
      now_ += kMillisecond;
      for (auto& wire : wires_) {
        wire->bus.now = now_;
        wire->drives->poll(now_);
      }
    }
    if (now_ - last_command_ >= static_cast<std::int64_t>(1e9 * kControlPeriod))
      sendCommand();
  }
  void step() { robot_->step(now_); }
  void setMoving(bool moving) { moving_ = moving; }
  double firstJoint() const { return robot_->position(0)[0]; }
  /// Frames received and sent by the HAL so far.
  double received() const { return static_cast<double>(counters(0).received + counters(1).received); }
  double sent() const { return static_cast<double>(counters(0).sent + counters(1).sent); }

 private:
  hal::FieldbusCounters counters(int bus) const { return robot_->bus(bus).counters(); }

  bool until(const std::function<bool()>& condition) {
    for (int k = 0; k < 2000 && !condition(); ++k) {
      prepare();
      step();
    }
    return condition();
  }
  /// Back and forth, all joints of an arm alike, so that the distances between tubes remain constant.
  void sendCommand() {
    last_command_ = now_;
    command_.header.session = 7;
    command_.header.age = 0.0;
    command_.header.sequence = ++sequence_;
    command_.header.arm_count = robot_->armCount();
    const double direction = sequence_ / 10 % 2 == 0 ? 1.0 : -1.0;
    for (int a = 0; a < robot_->armCount(); ++a) {
      command_.moving[static_cast<std::size_t>(a)] = moving_;
      for (int j = 0; j < robot_->jointCount(a); ++j) {
        const auto k = static_cast<std::size_t>(a) * safety::kMaxJointsPerArm + static_cast<std::size_t>(j);
        command_.velocity[k] = moving_ ? direction * (j < robot_->jointCount(a) / 2 ? 2e-3 : 0.5) : 0.0;
        command_.position[k] = robot_->setpoint(a)[j] + kControlPeriod * command_.velocity[k];
      }
    }
    robot_->command(command_, now_);
  }

  hal::HardwareConfig hardware_;
  std::int64_t now_ = 1'000 * kMillisecond;
  std::vector<std::unique_ptr<Wire>> wires_;
  std::unique_ptr<hal::RobotHardware> robot_;
  safety::RobotCommand command_;
  std::uint64_t sequence_ = 0;
  std::int64_t last_command_ = 0;
  bool moving_ = false;
};

hal::HardwareConfig preset() {
  return config::loadHardware(std::filesystem::path(TANDEM_SOURCE) / "config/presets/hardware/ark2024-two-buses.yaml");
}

void timeCycle(benchmark::State& state, bool moving, int count) {
  const hal::HardwareConfig hardware = preset();
  Percentiles percentiles(static_cast<std::size_t>(count));
  int failed = 0;
  double received = 0.0, sent = 0.0;
  for (auto _ : state) {
    Robot robot(hardware);
    failed = robot.enable() ? 0 : count;
    robot.setMoving(moving);
    const double received_before = robot.received(), sent_before = robot.sent();
    double seconds = 0.0, distance = 0.0;
    const double start = robot.firstJoint();
    for (int k = 0; k < count; ++k) {
      robot.prepare();
      seconds += percentiles.time(static_cast<std::size_t>(k), [&] { robot.step(); });
      failed += robot.enabled() ? 0 : 1;
      distance = std::max(distance, std::abs(robot.firstJoint() - start));
    }
    if (moving != (distance > 1e-3))
      failed = count;
    received = robot.received() - received_before;
    sent = robot.sent() - sent_before;
    state.SetIterationTime(seconds / count);
  }
  percentiles.report(state);
  state.counters["failed"] = failed;
  state.counters["received"] = received / count;
  state.counters["sent"] = sent / count;
  // The buses work in parallel: a cycle takes the time of one of them.
  const hal::BusLoad load = hal::computeLoad(hardware.planOf(0, safety::Budgets{}.drive_heartbeat));
  const double wire = 1e6 * load.cycle_time;
  state.counters["wire"] = wire;
  state.counters["load"] = load.load;
  state.counters["period"] = 1e6 * hardware.period;
  state.counters["wire_share"] = wire / (wire + state.counters["p50"]);
}

}  // namespace

void enrollAll() {
  constexpr int kCycles = 5000;
  for (const bool moving : {false, true}) {
    enroll(moving ? "hal/two arms/moving" : "hal/two arms/holding",
           [=](benchmark::State& state) { timeCycle(state, moving, kCycles); });
  }
}

}  // namespace tandem::bench
