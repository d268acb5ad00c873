// SPDX-License-Identifier: Apache-2.0
#include "hal/robot_hardware.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace tandem::hal {
namespace {

/// Event of one axis.
HardwareEvent eventOf(const AxisConfig& axis) noexcept {
  HardwareEvent event;
  event.arm = static_cast<std::uint8_t>(axis.arm);
  event.joint = static_cast<std::uint8_t>(axis.joint);
  return event;
}

}  // namespace

RobotHardware::RobotHardware(const HardwareConfig& config,
                             std::vector<std::unique_ptr<Fieldbus>> buses,
                             const RobotOptions& options)
    : config_(config),
      monitor_(static_cast<int>(config.arms.size()),
               options.budgets.commandAge(options.control_period),
               options.budgets.lost_samples),
      emergency_stop_(std::max(config.feedback_budget, 3.0 * config.period), options.emergency_reports) {
  if (buses.size() != config.buses.size())
    throw std::invalid_argument("hardware: found " + std::to_string(buses.size()) + " open buses, expected " +
                                std::to_string(config.buses.size()) + ", as in the hardware file");
  for (std::unique_ptr<Fieldbus>& bus : buses)
    buses_.push_back({std::move(bus), {}});
  for (const AxisConfig& axis : config_.axes) {
    BusSlot& slot = buses_.at(index(axis.bus));
    slot.axes.push_back(axes_.size());
    axes_.push_back(std::make_unique<Axis>(config_, axis, *slot.bus, options.budgets));
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
  for (const EmergencyInput& input : config_.emergency_stop)
    emergency_stop_.add(input, std::as_const(*axes_.at(index(input.axis))).driver());
  phases_.assign(axes_.size(), AxisPhase::kBooting);
}

void RobotHardware::start(std::int64_t now) noexcept {
  for (BusSlot& slot : buses_)
    slot.bus->start(now);
  for (ArmHardware& arm : arms_)
    arm.boot(now);
}

double RobotHardware::listeningTime() const noexcept {
  double longest = 0.0;
  for (const BusSlot& slot : buses_)
    longest = std::max(longest, slot.bus->listeningTime());
  return longest;
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
    slot.restart = slot.restart || slot.bus->state() == BusState::kOff;
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

void RobotHardware::onEvent(std::size_t bus, const FieldbusEvent& event) noexcept {
  using Kind = FieldbusEvent::Kind;
  const bool of_axis = event.kind == Kind::kFailure || event.kind == Kind::kEmergency;
  HardwareEvent reported = of_axis ? eventOf(axes_[buses_[bus].axes[index(event.axis)]]->config()) : HardwareEvent();
  reported.bus = static_cast<std::uint8_t>(bus);
  reported.encoder = event.encoder;
  switch (event.kind) {
    case Kind::kFailure:
      reported.kind = HardwareEvent::Kind::kNode;
      reported.failure = event.failure;
      break;
    case Kind::kEmergency:
      reported.kind = HardwareEvent::Kind::kEmergency;
      reported.code = event.code;
      break;
    case Kind::kState:
      reported.kind = HardwareEvent::Kind::kBus;
      reported.bus_state = event.state;
      break;
    case Kind::kMaster:
      reported.kind = HardwareEvent::Kind::kMaster;
      reported.master = event.master;
      break;
  }
  events_.push(reported);
}

void RobotHardware::receiveBuses(std::int64_t now) noexcept {
  for (std::size_t b = 0; b < buses_.size(); ++b) {
    buses_[b].bus->receive(now);
    FieldbusEvent event;
    while (buses_[b].bus->nextEvent(event))
      onEvent(b, event);
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
  HardwareEvent reported = eventOf(axis.config());
  if (axis.phase() == AxisPhase::kReady) {
    ++joint_resets_;
    reported.kind = HardwareEvent::Kind::kReady;
    reported.lost = axis.driver().lostProtections();
    events_.push(reported);
  } else if (axis.unconfirmed()) {
    reported.kind = HardwareEvent::Kind::kUnconfirmed;
    reported.memory = axis.memory();
    reported.position = axis.position();
    events_.push(reported);
  } else if (axis.unmeasured()) {
    reported.kind = HardwareEvent::Kind::kUnmeasured;
    events_.push(reported);
  } else if (axis.missingProtections() != 0) {
    reported.kind = HardwareEvent::Kind::kNode;
    reported.lost = axis.missingProtections();
    events_.push(reported);
  }
}

void RobotHardware::receive(std::int64_t now) noexcept {
  receiveBuses(now);
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
    HardwareEvent reported = eventOf(axis);
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
      if ((began & bit(HardwareGuard::kHoming)) != 0)
        reported.homing = arm.axis(j).homingFailure();
      reported.first_motion = !arm.axis(j).firstMotionConfirmed();
      events_.push(reported);
    }
  }
  for (std::size_t b = 0; b < buses_.size(); ++b)
    buses_[b].bus->transmit(now, carriesMotion(static_cast<int>(b)));
}

}  // namespace tandem::hal
