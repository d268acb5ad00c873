// SPDX-License-Identifier: Apache-2.0
#include "services/hal/hal_events.h"

#include <cmath>

#include "services/runtime/joint_text.h"

namespace tandem::hal_service {
namespace {

using Kind = hal::HardwareEvent::Kind;

/// "; the drive lacks X: after the end of the HAL the joint travels up to 1.5 mm".
std::string describeLoss(const hal::Axis& axis, hal::ProtectionMask lost) {
  const double travel = axis.travelWithoutHal(lost);
  return "; the drive lacks " + hal::describeProtections(lost) + ": after the end of the HAL the joint " +
         (std::isfinite(travel) ? "travels up to " + runtime::jointText(travel, axis.config().translation, "{:.2g}")
                                : "may continue, because nothing is known to stop it");
}

/// "position 3.2 mm is not plausible: it was 1.1 mm, 2.1 mm away, expected at most 0.5 mm; ...".
std::string describeJump(const hal::AxisConfig& axis, const hal::HardwareEvent& event) {
  const auto in_unit = [&](double value) { return runtime::jointText(value, axis.translation, "{:.4g}"); };
  std::string text = axis.name + ": the position after power on is " + in_unit(event.position) + "; ";
  if (event.memory.known())
    text += "it was " + in_unit(event.memory.position()) + " last, expected at most " +
            in_unit(event.memory.tolerance()) + " (jump_tolerance) away";
  else
    text += hal::reasonOf(event.memory.state());
  return text + ". Compare it with the joint, then tandem home --confirm, or correct the offset";
}

/// The first motion of a joint after a boot was another one than commanded: most likely a unit is wrong.
bool contradictsUnits(const hal::HardwareEvent& event) {
  constexpr hal::GuardMask kOfMotion =
      hal::bit(hal::HardwareGuard::kOverspeed) | hal::bit(hal::HardwareGuard::kFollowing);
  return (event.guards & hal::bit(hal::HardwareGuard::kFirstMotion)) != 0 ||
         (event.first_motion && (event.guards & kOfMotion) != 0);
}

/// ": the drive left operation during the run"; empty: the event is not about a homing run.
std::string reasonOf(hal::HomingFailure failure) {
  const std::string text(hal::describe(failure));
  return text.empty() ? text : ": " + text;
}

}  // namespace

std::string describeLost(const hal::HardwareConfig& hardware, const dds::HalStatus& status) {
  std::string text;
  for (const hal::AxisConfig& axis : hardware.axes) {
    const std::uint16_t lost = status.axis_lost[dds::jointIndex(axis.arm, axis.joint)];
    if (lost != 0)
      text += (text.empty() ? "" : "; ") + axis.name + ": " + hal::describeProtections(lost);
  }
  return text.empty() ? "none" : text;
}

std::string nameOf(const hal::BusConfig& bus) { return "bus " + bus.name + " (" + bus.address + ")"; }

void DeviceFailures::note(const hal::HardwareEvent& event, const std::string& text) {
  if (event.kind == Kind::kNode)
    reasons_[dds::jointIndex(event.arm, event.joint)] = text;
}

runtime::Details DeviceFailures::details(const hal::HardwareConfig& hardware, const dds::HalStatus& status) const {
  runtime::Details details;
  for (const hal::AxisConfig& axis : hardware.axes) {
    const auto reason = reasons_.find(dds::jointIndex(axis.arm, axis.joint));
    if (reason != reasons_.end() && status.axis_phase[reason->first] == static_cast<int>(hal::AxisPhase::kFailed))
      details.push_back({runtime::kFailedKey + axis.name, reason->second});
  }
  return details;
}

bool isRemarkable(const hal::HardwareEvent& event, const hal::RobotHardware& robot) {
  return event.kind == Kind::kReady &&
         (event.lost != 0 || !robot.arm(event.arm).axis(event.joint).driver().remarks().empty());
}

bool isProblem(const hal::HardwareEvent& event) {
  return event.kind == Kind::kGuard || event.kind == Kind::kNode || event.kind == Kind::kMaster ||
         event.kind == Kind::kUnconfirmed || (event.kind == Kind::kEmergency && event.code != 0) ||
         (event.kind == Kind::kBus && event.bus_state != hal::BusState::kActive);
}

std::string describe(const hal::HardwareEvent& event, const hal::RobotHardware& robot) {
  if (event.kind == Kind::kBus)
    return "bus " + robot.config().buses[event.bus].name + ": " + std::string(name(event.bus_state));
  if (event.kind == Kind::kMaster)
    return nameOf(robot.config().buses[event.bus]) + robot.bus(event.bus).describeMaster(event.master);
  if (event.kind == Kind::kReleased)
    return "emergency stop released; `tandem robot disable` clears the faults";
  const hal::Axis& axis = robot.arm(event.arm).axis(event.joint);
  const std::string who = axis.driver().deviceName(event.encoder);
  switch (event.kind) {
    case Kind::kGuard:
      return axis.config().name + ": " + hal::describeGuards(event.guards) + reasonOf(event.homing) +
             (contradictsUnits(event)
                  ? ": the joint did not travel as commanded; check counts_per_revolution, gear_ratio, lead, "
                    "velocity_unit, reversed, and the same of its encoder"
                  : "");
    case Kind::kEmergency:
      return who + ": " + (event.code == 0 ? "emergency cleared" : "emergency, " + hal::describeErrorCode(event.code));
    case Kind::kNode:
      return who + ": " +
             (event.lost == 0 ? axis.driver().describe(event.failure, event.encoder)
                              : "the drive lacks " + hal::describeProtections(event.lost) +
                                    ", and may go on when the HAL ends: `accept` this axis in the hardware file "
                                    "(docs/hardware.md), or give the drive one of them");
    case Kind::kReady:
      return axis.config().name + ": ready" + (event.lost == 0 ? "" : describeLoss(axis, event.lost)) +
             axis.driver().remarks();
    case Kind::kUnconfirmed:
      return describeJump(axis.config(), event);
    case Kind::kUnmeasured:
      return axis.config().name + ": measure the position of this joint, then tandem home --measured";
    case Kind::kBus:
    case Kind::kMaster:
    case Kind::kReleased:
      break;
  }
  return who;
}

}  // namespace tandem::hal_service
