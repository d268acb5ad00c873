// SPDX-License-Identifier: Apache-2.0
#include "services/hal/hal_events.h"

namespace tandem::hal_service {
namespace {

using Kind = hal::HardwareEvent::Kind;
using Reason = hal::canopen::NodeFailure::Reason;

std::string describeFailure(const hal::canopen::Node& node, const hal::canopen::NodeFailure& failure) {
  switch (failure.reason) {
    case Reason::kNone:
      return "no failure";
    case Reason::kNoBootUp:
      return "no boot-up message after the reset";
    case Reason::kNotStarted:
      return "did not become operational";
    case Reason::kHeartbeatLost:
      return "heartbeat lost";
    case Reason::kRebooted:
      return "rebooted without a request";
    case Reason::kLeftOperational:
      return "left the operational state without a request";
    case Reason::kAborted:
    case Reason::kMismatch:
      break;
  }
  std::string text = "setup", advice;
  if (failure.step >= 0 && failure.step < static_cast<int>(node.steps().size())) {
    const hal::canopen::SetupStep& step = node.steps()[static_cast<std::size_t>(failure.step)];
    text = step.what + " " + hal::canopen::describe(step.object);
    if ((step.protections & node.lostProtections()) != 0)
      advice = "; without " + hal::describeProtections(node.lostProtections()) +
               " the drive may go on when the HAL ends: change its setting, or `accept` this axis in the hardware file "
               "(docs/hardware.md)";
    if (failure.reason == Reason::kMismatch)
      return text + ": found " + std::to_string(failure.value) + ", expected " + std::to_string(step.value);
  }
  return text + ": " + hal::canopen::describe(failure.abort) + advice;
}

std::string describeMaster(hal::canopen::MasterFrame frame) {
  const std::string received = ": " + std::string(name(frame)) + " from another master";
  if (frame == hal::canopen::MasterFrame::kSdoRequest)
    return received + "; two SDO clients of one node disturb each other's parameter access";
  return received + "; stop it, then `tandem robot disable`";
}

}  // namespace

std::string nameOf(const hal::BusConfig& bus) { return "bus " + bus.name + " (" + bus.address + ")"; }

bool isProblem(const hal::HardwareEvent& event) {
  return event.kind == Kind::kGuard || event.kind == Kind::kNode || event.kind == Kind::kMaster ||
         (event.kind == Kind::kEmergency && event.code != 0) ||
         (event.kind == Kind::kBus && event.bus_state != hal::can::BusState::kActive);
}

std::string describe(const hal::HardwareEvent& event, const hal::RobotHardware& robot) {
  if (event.kind == Kind::kBus)
    return "bus " + robot.config().buses[event.bus].name + ": " + std::string(name(event.bus_state));
  if (event.kind == Kind::kMaster)
    return nameOf(robot.config().buses[event.bus]) + describeMaster(event.master);
  if (event.kind == Kind::kReleased)
    return "emergency stop released; `tandem robot disable` clears the faults";
  const hal::Axis& axis = robot.arm(event.arm).axis(event.joint);
  const hal::canopen::Node* encoder = axis.encoderNode();
  const hal::canopen::Node& node = event.encoder && encoder != nullptr ? *encoder : axis.driveNode();
  const std::string who = node.setup().name + " (node " + std::to_string(node.id()) + ")";
  switch (event.kind) {
    case Kind::kGuard:
      return axis.config().name + ": " + hal::describeGuards(event.guards);
    case Kind::kEmergency:
      return who + ": " + (event.code == 0 ? "emergency cleared" : "emergency, " + hal::describeErrorCode(event.code));
    case Kind::kNode:
      return who + ": " + describeFailure(node, event.failure);
    case Kind::kReady:
      return axis.config().name + ": ready" +
             (event.lost == 0 ? "" : "; the drive lacks " + hal::describeProtections(event.lost));
    case Kind::kBus:
    case Kind::kMaster:
    case Kind::kReleased:
      break;
  }
  return who;
}

}  // namespace tandem::hal_service
