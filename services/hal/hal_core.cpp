// SPDX-License-Identifier: Apache-2.0
#include "services/hal/hal_core.h"

#include <algorithm>
#include <cstdio>

#include "services/setup/actuation.h"

namespace tandem::service {
namespace {

constexpr std::uint8_t kHome = 1;

hal::RobotOptions robotOptions(const config::Deployment& deployment) {
  return {deployment.control_period, deployment.budgets, deployment.emergency_stop_budget};
}

void writeAxis(const hal::Axis& axis, std::size_t i, dds::HalStatus& status) noexcept {
  status.axis_phase[i] = static_cast<std::uint8_t>(axis.phase());
  status.axis_state[i] = static_cast<std::uint8_t>(axis.driveState());
  status.axis_error[i] = axis.errorCode();
  status.axis_guards[i] = axis.guards();
  status.axis_temperature[i] = static_cast<float>(axis.temperature());
  status.following_error[i] = axis.followingError();
  const bool both = axis.config().encoder && axis.referenced();
  status.encoder_difference[i] = both ? axis.encoderPosition() - axis.position() : 0.0;
}

}  // namespace

dds::Reply replyOf(const HalAnswer& answer) {
  dds::Reply reply;
  reply.client = answer.client;
  reply.request = answer.request;
  reply.accepted = answer.code == dds::ReplyCode::kOk ? 1 : 0;
  reply.code = static_cast<std::uint16_t>(answer.code);
  reply.reason = answer.reason.data();
  reply.value = answer.value;
  return reply;
}

HalCore::HalCore(const Setup& setup, const hal::HardwareConfig& hardware, const std::vector<hal::can::Bus*>& buses)
    : setup_(setup), robot_(hardware, buses, robotOptions(setup.deployment)) {}

void HalCore::onCommand(const dds::ActuationCommand& from, std::int64_t now) noexcept {
  // A command that answers a state of another session answers none of ours: its age is infinite.
  const bool ours = from.state_session == setup_.session;
  readCommand(from, ours ? stamps_.age(from.answers_state, now) : safety::kUnlimited, command_);
  keepUnseenFaults(robot_, ours ? from.answers_state : 0, shown_faults_, command_);
  robot_.command(command_, now);
}

HalAnswer HalCore::onOrder(const HalOrder& order, std::int64_t now) noexcept {
  HalAnswer answer;
  answer.client = order.client;
  answer.request = order.request;
  const auto refuse = [&](dds::ReplyCode code, const char* who, const char* why) {
    answer.code = code;
    std::snprintf(answer.reason.data(), answer.reason.size(), "%s%s", who, why);
    return answer;
  };
  if (order.kind != kHome)
    return refuse(dds::ReplyCode::kUnknown, "", "unknown kind of request, expected 1 (home)");
  if (order.arm != dds::kAllArms && order.arm >= robot_.armCount())
    return refuse(dds::ReplyCode::kMalformed, "", "arm: the robot has fewer, or 255 for all");
  const int first = order.arm == dds::kAllArms ? 0 : order.arm;
  const int last = order.arm == dds::kAllArms ? robot_.armCount() - 1 : order.arm;
  answer.value = 1;
  for (int a = first; a <= last; ++a) {
    const char* name = robot_.config().arms[static_cast<std::size_t>(a)].name.c_str();
    switch (robot_.home(a, now)) {
      case hal::ArmHardware::HomingAnswer::kDone:
        break;
      case hal::ArmHardware::HomingAnswer::kRunning:
        answer.value = 0;
        break;
      case hal::ArmHardware::HomingAnswer::kNotDisabled:
        return refuse(dds::ReplyCode::kWrongState, name, " is not DISABLED; disable it first");
      case hal::ArmHardware::HomingAnswer::kNotReady:
        return refuse(dds::ReplyCode::kWrongState, name, ": its nodes are not up, or something stands against it");
    }
  }
  return answer;
}

void HalCore::state(std::int64_t now, dds::ActuationState& state) noexcept {
  state.session = setup_.session;
  state.sequence = ++sequence_;
  state.stamp = now;
  state.placements = robot_.placements();
  writeState(robot_, state);
  recordFaults(state, shown_faults_);
  // Whoever has disabled an arm in FAULT shall wait for its boot, and not take what is being cleared for a new fault.
  for (int a = 0; a < robot_.armCount(); ++a) {
    if (robot_.arm(a).rebooting())
      state.faults[static_cast<std::size_t>(a)] = 0;
  }
  stamps_.record(state.sequence, now);
}

void HalCore::status(std::int64_t now, dds::HalStatus& status) const noexcept {
  status.session = setup_.session;
  status.sequence = sequence_;  // of the state that it goes with
  status.stamp = now;
  writeStatus(robot_, status);
  for (int a = 0; a < robot_.armCount(); ++a) {
    const hal::ArmHardware& arm = robot_.arm(a);
    status.homed[static_cast<std::size_t>(a)] = arm.homed() ? 1 : 0;
    status.power[static_cast<std::size_t>(a)] = static_cast<std::uint8_t>(arm.power());
    for (int j = 0; j < arm.jointCount(); ++j)
      writeAxis(arm.axis(j), dds::jointIndex(a, j), status);
  }
  for (int g = 0; g < hal::kHardwareGuardCount; ++g) {
    const hal::HardwareGuardCounters::Entry& entry = robot_.hardwareGuards()[static_cast<hal::HardwareGuard>(g)];
    const auto i = static_cast<std::size_t>(g);
    status.hardware_count[i] = entry.count;
    status.hardware_arm[i] = entry.arm;
    status.hardware_joint[i] = entry.joint;
  }
  status.bus_count =
      static_cast<std::uint8_t>(std::min<int>(robot_.busCount(), static_cast<int>(status.bus_state.size())));
  status.bus_load = 0.0;
  for (int b = 0; b < status.bus_count; ++b) {
    const auto i = static_cast<std::size_t>(b);
    const hal::can::BusCounters& counters = robot_.bus(b).counters();
    status.bus_state[i] = static_cast<std::uint8_t>(robot_.bus(b).state());
    status.bus_loads[i] = robot_.busLoad(b);
    status.bus_dropped[i] = counters.tx_dropped + counters.tx_failed;
    status.bus_overflow[i] = counters.rx_overflow;
    status.bus_load = std::max(status.bus_load, status.bus_loads[i]);
  }
}

}  // namespace tandem::service
