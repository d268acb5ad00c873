// SPDX-License-Identifier: Apache-2.0
#include "hal/robot_hardware.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "hal/nanoseconds.h"

namespace tandem::hal {
namespace {

/// Largest payload of a cyclic frame: controlword and target, or statusword and position.
constexpr int kTypicalBytes = 6;

canopen::NetworkOptions networkOptions(const HardwareConfig& config, int b, double heartbeat_budget) {
  canopen::NetworkOptions options;
  options.own_id = static_cast<std::uint8_t>(config.buses[static_cast<std::size_t>(b)].node_id);
  options.request_interval =
      static_cast<int>(std::lround(config.trafficOf(b, heartbeat_budget).request_interval / config.period));
  options.heartbeat_period = static_cast<std::int64_t>(1e9 * heartbeat_budget / kHeartbeatsPerBudget);
  options.master_silence = nanoseconds(canopen::listeningTime(heartbeat_budget));
  return options;
}

}  // namespace

RobotHardware::RobotHardware(const HardwareConfig& config,
                             const std::vector<can::Bus*>& buses,
                             const RobotOptions& options)
    : config_(config),
      listening_time_(canopen::listeningTime(options.budgets.drive_heartbeat)),
      monitor_(static_cast<int>(config.arms.size()),
               options.budgets.commandAge(options.control_period),
               options.budgets.lost_samples),
      emergency_stop_(std::max(config.feedback_budget, 3.0 * config.period), options.emergency_reports) {
  if (buses.size() != config.buses.size())
    throw std::invalid_argument("hardware: one open bus per configured one expected");
  const double heartbeat_budget = options.budgets.drive_heartbeat;
  for (std::size_t b = 0; b < buses.size(); ++b) {
    BusSlot slot;
    slot.bus = buses[b];
    slot.network =
        std::make_unique<canopen::Network>(*slot.bus, networkOptions(config, static_cast<int>(b), heartbeat_budget));
    buses_.push_back(std::move(slot));
  }
  for (const AxisConfig& axis : config_.axes) {
    BusSlot& slot = buses_.at(index(axis.bus));
    axes_.push_back(std::make_unique<Axis>(config_, axis, *slot.network, options.budgets));
    slot.axis_of_node.resize(index(slot.network->nodeCount()), static_cast<int>(axes_.size()) - 1);
  }
  const safety::SupervisorOptions supervisor{options.control_period, options.budgets, false};
  for (std::size_t a = 0; a < config_.arms.size(); ++a) {
    std::vector<Axis*> of_arm;
    for (const auto& axis : axes_) {
      if (axis->config().arm == static_cast<int>(a))
        of_arm.push_back(axis.get());
    }
    if (static_cast<int>(of_arm.size()) != config_.arms[a].limits.jointCount())
      throw std::invalid_argument("hardware: " + config_.arms[a].name + ": found " + std::to_string(of_arm.size()) +
                                  " axes, expected " + std::to_string(config_.arms[a].limits.jointCount()) +
                                  ", one for each joint");
    arms_.emplace_back(config_.arms[a], std::move(of_arm), supervisor, config_.power_budget, config_.period);
  }
  for (const EmergencyInput& input : config_.emergency_stop) {
    const Axis& axis = *axes_.at(index(input.axis));
    emergency_stop_.add(input, *buses_[index(axis.config().bus)].network, axis.driveIndex());
  }
  phases_.assign(axes_.size(), AxisPhase::kBooting);
}

void RobotHardware::start(std::int64_t now) noexcept {
  for (BusSlot& slot : buses_)
    slot.network->setHeartbeat(true);
  for (ArmHardware& arm : arms_)
    arm.boot(now);
}

bool RobotHardware::off() const noexcept {
  for (const ArmHardware& arm : arms_) {
    if (arm.power() != ArmPower::kOff || arm.homing())
      return false;
  }
  return true;
}

bool RobotHardware::standing() const noexcept {
  for (const ArmHardware& arm : arms_) {
    if (!arm.standing())
      return false;
  }
  return true;
}

bool RobotHardware::command(const safety::RobotCommand& command, std::int64_t now) noexcept {
  const safety::StreamCheck checked = monitor_.check(command.header, standing());
  for (int a = 0; a < armCount(); ++a) {
    ArmHardware& arm = arms_[index(a)];
    if (checked.new_session)
      arm.disableForNewSession();
    const bool was_rebooting = arm.rebooting();
    guards_.add(a, arm.command(command.forArm(a, arm.jointCount(), checked), now));
    if (arm.rebooting() && !was_rebooting)
      askForRestarts();
  }
  if (std::ranges::none_of(arms_, [](const ArmHardware& arm) { return arm.supervisor().powered(); }))
    monitor_.resetLosses();
  else if (checked.lost.faults != 0)
    stopPowered(checked.lost);
  return checked.faults == 0;
}

void RobotHardware::askForRestarts() noexcept {
  for (BusSlot& slot : buses_)
    slot.restart = slot.restart || slot.bus->state() == can::BusState::kOff;
}

double RobotHardware::busSuccess(int b) const noexcept {
  double worst = 1.0;
  for (const auto& axis : axes_)
    worst = axis->config().bus == b ? std::min(worst, axis->feedbackSuccess()) : worst;
  return worst;
}

bool RobotHardware::takeRestart(int b) noexcept { return std::exchange(buses_[index(b)].restart, false); }

void RobotHardware::stop() noexcept {
  for (ArmHardware& arm : arms_)
    arm.stop({bit(safety::Fault::kStopRequested)});
}

void RobotHardware::stopPowered(const safety::FaultRecord& record) noexcept {
  for (ArmHardware& arm : arms_) {
    if (arm.supervisor().powered())
      arm.stop(record);
  }
}

void RobotHardware::onEvent(std::size_t bus, const canopen::NetworkEvent& event) noexcept {
  HardwareEvent reported;
  reported.bus = static_cast<std::uint8_t>(bus);
  if (event.kind == canopen::NetworkEvent::Kind::kBusState) {
    reported.kind = HardwareEvent::Kind::kBus;
    reported.bus_state = event.bus_state;
    return events_.push(reported);
  }
  if (event.kind == canopen::NetworkEvent::Kind::kMaster) {
    reported.kind = HardwareEvent::Kind::kMaster;
    reported.master = event.master;
    return events_.push(reported);
  }
  Axis& axis = *axes_[index(buses_[bus].axis_of_node[index(event.node)])];
  reported.arm = static_cast<std::uint8_t>(axis.config().arm);
  reported.joint = static_cast<std::uint8_t>(axis.config().joint);
  reported.encoder = event.node == axis.encoderIndex();
  if (event.kind == canopen::NetworkEvent::Kind::kEmcy) {
    axis.onEmcy(event.node, event.emcy);
    reported.kind = HardwareEvent::Kind::kEmergency;
    reported.code = event.emcy.code;
    events_.push(reported);
  } else if (event.phase == canopen::NodePhase::kFailed) {
    reported.kind = HardwareEvent::Kind::kNode;
    reported.failure = buses_[bus].network->node(event.node).failure();
    events_.push(reported);
  }
}

void RobotHardware::measureLoad(BusSlot& slot, std::size_t bus, std::int64_t now) noexcept {
  if (slot.window != 0 && now - slot.window < kSecond)
    return;
  const can::BusCounters& counters = slot.bus->counters();
  const std::uint64_t frames = counters.sent + counters.received;
  if (slot.window != 0) {
    const double seconds = 1e-9 * static_cast<double>(now - slot.window);
    const double bits = static_cast<double>(frames - slot.frames) * frameBits(kTypicalBytes);
    slot.load = bits / seconds / config_.buses[bus].bit_rate;
  }
  slot.frames = frames;
  slot.window = now;
}

void RobotHardware::receiveFrames(std::int64_t now) noexcept {
  for (std::size_t b = 0; b < buses_.size(); ++b) {
    buses_[b].network->receive(now);
    canopen::NetworkEvent event;
    while (buses_[b].network->nextEvent(event))
      onEvent(b, event);
    measureLoad(buses_[b], b, now);
  }
}

PositionSnapshot RobotHardware::lastPositions() const noexcept {
  PositionSnapshot snapshot;
  for (std::size_t i = 0; i < axes_.size(); ++i)
    snapshot.axes[i] = {axes_[i]->memory().known(), axes_[i]->memory().position()};
  return snapshot;
}

/// The phase of an axis has changed.
void RobotHardware::reportReference(std::size_t i) noexcept {
  const Axis& axis = *axes_[i];
  HardwareEvent reported;
  reported.arm = static_cast<std::uint8_t>(axis.config().arm);
  reported.joint = static_cast<std::uint8_t>(axis.config().joint);
  if (axis.phase() == AxisPhase::kReady) {
    ++joint_resets_;
    reported.kind = HardwareEvent::Kind::kReady;
    reported.lost = axis.driveNode().lostProtections();
    events_.push(reported);
  } else if (axis.unconfirmed()) {
    reported.kind = HardwareEvent::Kind::kUnconfirmed;
    reported.memory = axis.memory();
    reported.position = axis.position();
    events_.push(reported);
  }
}

void RobotHardware::receive(std::int64_t now) noexcept {
  receiveFrames(now);
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    axes_[i]->update(now);
    const AxisPhase phase = axes_[i]->phase();
    if (phase != std::exchange(phases_[i], phase))
      reportReference(i);
  }
}

/// Before the arms: the loss of torque of their drives is a consequence of the emergency stop, not the cause.
void RobotHardware::watchEmergencyStop(std::int64_t now) noexcept {
  const safety::EmergencyStop before = emergency_stop_.state();
  const int began = emergency_stop_.update(now);
  for (ArmHardware& arm : arms_)
    arm.setEmergencyStop(emergency_stop_.state() == safety::EmergencyStop::kPressed || emergency_stop_.silent(),
                         emergency_stop_.lost(), emergency_stop_.known());
  if (began >= 0) {
    const AxisConfig& axis = config_.axes[index(began)];
    HardwareEvent reported;
    reported.arm = static_cast<std::uint8_t>(axis.arm);
    reported.joint = static_cast<std::uint8_t>(axis.joint);
    reported.guards = bit(HardwareGuard::kEmergencyStop);
    hardware_guards_.add(reported.guards, axis.arm, axis.joint);
    events_.push(reported);
  }
  if (before == safety::EmergencyStop::kPressed && emergency_stop_.state() == safety::EmergencyStop::kReleased) {
    HardwareEvent reported;
    reported.kind = HardwareEvent::Kind::kReleased;
    events_.push(reported);
  }
}

bool RobotHardware::carriesMotion(int b) const noexcept {
  return std::ranges::any_of(axes_, [b](const auto& axis) { return axis->config().bus == b && axis->operating(); });
}

void RobotHardware::step(std::int64_t now) noexcept {
  receive(now);
  watchEmergencyStop(now);
  for (int a = 0; a < armCount(); ++a) {
    ArmHardware& arm = arms_[index(a)];
    arm.step(config_.period, now, began_);
    for (int j = 0; j < arm.jointCount(); ++j) {
      const GuardMask began = began_[index(j)];
      if (began == 0)
        continue;
      hardware_guards_.add(began, a, j);
      HardwareEvent reported;
      reported.arm = static_cast<std::uint8_t>(a);
      reported.joint = static_cast<std::uint8_t>(j);
      reported.guards = began;
      events_.push(reported);
    }
  }
  for (std::size_t b = 0; b < buses_.size(); ++b)
    buses_[b].network->transmit(now, {true, true, carriesMotion(static_cast<int>(b))});
}

}  // namespace tandem::hal
