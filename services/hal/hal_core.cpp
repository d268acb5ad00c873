// SPDX-License-Identifier: Apache-2.0
#include "services/hal/hal_core.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "operation/permission.h"
#include "services/dds/reply.h"

namespace tandem::hal_service {
namespace {

hal::RobotOptions robotOptions(const config::Deployment& deployment) {
  return {deployment.control_period, deployment.budgets, deployment.emergency_stop_budget};
}

void writeAxis(const hal::Axis& axis, std::size_t i, dds::HalStatus& status) noexcept {
  status.axis_phase[i] = static_cast<std::uint8_t>(axis.phase());
  status.axis_state[i] = static_cast<std::uint8_t>(axis.driveState());
  status.axis_error[i] = axis.driver().errorCode();
  status.axis_guards[i] = axis.guards();
  status.axis_lost[i] = static_cast<std::uint16_t>(axis.driver().lostProtections());
  status.axis_limit_switch[i] = static_cast<std::uint8_t>(axis.limitSwitch());
  const hal::PositionMemory& memory = axis.memory();
  status.axis_last[i] = static_cast<std::uint8_t>(memory.state());
  status.axis_last_position[i] = memory.position();
  status.axis_jump_tolerance[i] = memory.tolerance();
  status.axis_temperature[i] = static_cast<float>(axis.driver().temperature());
  status.following_error[i] = axis.followingError();
  const bool both = axis.config().encoder && axis.referenced();
  status.encoder_difference[i] = both ? axis.encoderPosition() - axis.position() : 0.0;
}

void refuse(HalAnswer& answer, dds::ReplyCode code, const char* who, const char* why, const char* more = "") noexcept {
  answer.code = code;
  std::snprintf(answer.reason.data(), answer.reason.size(), "%s%s%s", who, why, more);
}

/// One bit for each joint.
std::uint8_t notHomed(const hal::ArmHardware& arm) noexcept {
  unsigned joints = 0;
  for (int j = 0; j < arm.jointCount(); ++j)
    joints |= arm.axis(j).referenced() ? 0u : 1u << j;
  return static_cast<std::uint8_t>(joints);
}

}  // namespace

dds::Reply replyOf(const HalAnswer& answer) {
  return dds::replyTo(answer, answer.code, answer.reason.data(), answer.value);
}

HalCore::HalCore(const runtime::Setup& setup,
                 const hal::HardwareConfig& hardware,
                 std::vector<std::unique_ptr<hal::Fieldbus>> buses)
    : DriveCore(setup, hardware, std::move(buses), robotOptions(setup.deployment)),
      commands_(setup.deployment.budgets.commandAge(setup.deployment.control_period)) {}

void HalCore::onCommand(const dds::ActuationCommand& command, std::int64_t now, std::uint64_t arrivals) noexcept {
  if (!drives_.command(read(command, now, arrivals), now))
    return;
  commander_ = command.commander;
  may_home_ = command.may_home;
  commands_.feed(now);
}

idl::RefusalReason HalCore::againstHoming(const ParsedHalRequest& request, int arm, std::int64_t now) const noexcept {
  using enum idl::RefusalReason;
  if (commands_.expired(now))
    return kNoCommand;
  switch (operation::requesterOf(request.client, commander_)) {
    case operation::Requester::kNoLeaseOwner:
      return kNoLease;
    case operation::Requester::kOtherClient:
      return kOtherLease;
    case operation::Requester::kLeaseOwner:
      break;
  }
  return may_home_[static_cast<std::size_t>(arm)] != 0 ? kNone : kNotDisabled;
}

void HalCore::home(int arm, std::int64_t now, HalAnswer& answer) noexcept {
  const char* name = drives_.config().arms[static_cast<std::size_t>(arm)].name.c_str();
  switch (drives_.home(arm, now)) {
    case hal::ArmHardware::HomingAnswer::kDone:
      return;
    case hal::ArmHardware::HomingAnswer::kRunning:
      answer.value = 0;
      return;
    case hal::ArmHardware::HomingAnswer::kNotDisabled:
      return refuse(answer, dds::ReplyCode::kWrongState, name, " is not DISABLED; disable it first");
    case hal::ArmHardware::HomingAnswer::kUnconfirmed:
      return refuse(answer, dds::ReplyCode::kWrongState, name,
                    ": a joint may not be where it was last: see tandem status; if it is right, tandem home --confirm");
    case hal::ArmHardware::HomingAnswer::kUnmeasured:
      return refuse(answer, dds::ReplyCode::kWrongState, name,
                    ": measure the joints named by tandem status, then tandem home --measured JOINT=POSITION");
    case hal::ArmHardware::HomingAnswer::kNotReady:
      return refuse(answer, dds::ReplyCode::kWrongState, name,
                    ": a drive has failed or a guard is active; see tandem status, then tandem robot disable");
  }
}

void HalCore::takeMeasurement(int arm, HalAnswer& answer) noexcept {
  if (answer.joint >= drives_.jointCount(arm))
    return refuse(answer, dds::ReplyCode::kMalformed, "", "joint: expected a joint of the arm");
  const char* name = drives_.arm(arm).axis(answer.joint).config().name.c_str();
  switch (drives_.takeMeasurement(arm, answer.joint, answer.position)) {
    case hal::MeasurementAnswer::kTaken:
      return;
    case hal::MeasurementAnswer::kNotDisabled:
      return refuse(answer, dds::ReplyCode::kWrongState, name, ": the arm has power or moves; disable it first");
    case hal::MeasurementAnswer::kNotUp:
      return refuse(answer, dds::ReplyCode::kWrongState, name,
                    ": its drive or encoder has not started; see tandem status, then tandem robot disable");
    case hal::MeasurementAnswer::kGuarded:
      return refuse(answer, dds::ReplyCode::kWrongState, name,
                    ": a guard is active; see tandem status, then tandem robot disable");
    case hal::MeasurementAnswer::kMoves:
      return refuse(answer, dds::ReplyCode::kWrongState, name, ": the joint moves; measure it at standstill");
    case hal::MeasurementAnswer::kOtherReference:
      return refuse(answer, dds::ReplyCode::kMalformed, name,
                    ": found another `reference` in the hardware file, expected `reference: measured`");
    case hal::MeasurementAnswer::kOutside:
      return refuse(answer, dds::ReplyCode::kOutsideLimits, name,
                    ": the position is farther outside the limits than they are apart; check its unit");
  }
}

HalAnswer HalCore::onRequest(const ParsedHalRequest& request, std::int64_t now) noexcept {
  HalAnswer answer{request};
  const bool measured = request.kind == static_cast<std::uint8_t>(dds::HalKind::kMeasured);
  if (!measured && request.kind != static_cast<std::uint8_t>(dds::HalKind::kHome))
    refuse(answer, dds::ReplyCode::kUnknown, "", "unknown kind of request, expected 1 (home) or 2 (measured)");
  else if (request.arm >= drives_.armCount() && (measured || request.arm != dds::kAllArms))
    refuse(answer, dds::ReplyCode::kMalformed, "",
           measured ? "arm: expected an arm of the robot" : "arm: expected an arm of the robot, or 255 for all");
  if (answer.code != dds::ReplyCode::kOk)
    return answer;
  const int first = request.arm == dds::kAllArms ? 0 : request.arm;
  const int last = request.arm == dds::kAllArms ? drives_.armCount() - 1 : request.arm;
  answer.value = 1;
  for (int a = first; a <= last; ++a)
    answer.not_homed[static_cast<std::size_t>(a)] = notHomed(drives_.arm(a));
  for (int a = first; a <= last && answer.code == dds::ReplyCode::kOk; ++a) {
    if (const operation::Refusal refusal{againstHoming(request, a, now), idl::Action::kHomeDrives}) {
      const char* name = drives_.config().arms[static_cast<std::size_t>(a)].name.c_str();
      refuse(answer, refusal.code(), name, ": ", idl::name(refusal.reason).data());
    } else {
      measured ? takeMeasurement(a, answer) : home(a, now, answer);
    }
  }
  return answer;
}

void HalCore::state(std::int64_t now, dds::ActuationState& state) noexcept {
  show(now, now, state);
  // No faults during the boot after `disable` in FAULT: a client waits for its end, and a fault that is being cleared
  // must not appear as a new one.
  for (int a = 0; a < drives_.armCount(); ++a) {
    if (drives_.arm(a).rebooting())
      state.faults[static_cast<std::size_t>(a)] = 0;
  }
}

void HalCore::status(dds::HalStatus& status) const noexcept {
  show(status);
  for (int a = 0; a < drives_.armCount(); ++a) {
    const hal::ArmHardware& arm = drives_.arm(a);
    status.homed[static_cast<std::size_t>(a)] = arm.homed() ? 1 : 0;
    status.power[static_cast<std::size_t>(a)] = static_cast<std::uint8_t>(arm.power());
    for (int j = 0; j < arm.jointCount(); ++j)
      writeAxis(arm.axis(j), dds::jointIndex(a, j), status);
  }
  for (int g = 0; g < hal::kHardwareGuardCount; ++g) {
    const hal::HardwareGuardCounters::Entry& entry = drives_.hardwareGuards()[static_cast<hal::HardwareGuard>(g)];
    const auto i = static_cast<std::size_t>(g);
    status.hardware_count[i] = entry.count;
    status.hardware_arm[i] = entry.arm;
    status.hardware_joint[i] = entry.joint;
  }
  status.bus_count =
      static_cast<std::uint8_t>(std::min<int>(drives_.busCount(), static_cast<int>(status.bus_state.size())));
  status.bus_load = 0.0;
  for (int b = 0; b < status.bus_count; ++b) {
    const auto i = static_cast<std::size_t>(b);
    const hal::FieldbusCounters counters = drives_.bus(b).counters();
    status.bus_state[i] = static_cast<std::uint8_t>(drives_.bus(b).state());
    status.bus_loads[i] = drives_.bus(b).load();
    status.bus_dropped[i] = counters.dropped;
    status.bus_overflow[i] = counters.overflow;
    status.bus_success[i] = drives_.busSuccess(b);
    status.bus_load = std::max(status.bus_load, status.bus_loads[i]);
  }
}

}  // namespace tandem::hal_service
