// SPDX-License-Identifier: Apache-2.0
#include "hal/hardware.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "hal/drives/cyclic_objects.h"

namespace tandem::hal {

namespace {

BusPlan planWith(const HardwareConfig& hardware, int bus, const BusTraffic& traffic) {
  const BusConfig& config = hardware.buses.at(static_cast<std::size_t>(bus));
  BusPlan plan;
  plan.bit_rate = config.bit_rate;
  plan.period = hardware.period;
  plan.load_limit = config.load_limit;
  plan.streams = streamsOf(traffic);
  return plan;
}

}  // namespace

BusTraffic HardwareConfig::trafficOf(int bus, double heartbeat_budget) const {
  BusTraffic traffic;
  for (const AxisConfig& axis : axes) {
    if (axis.bus != bus)
      continue;
    ++traffic.drives;
    traffic.encoders += axis.hasEncoderNode() ? 1 : 0;
    traffic.guarded += axis.watch == MutualWatch::kNodeGuarding ? 1 : 0;
    countFrames(traffic.commands, commandObjects(axis), axis.pdo_objects);
    countFrames(traffic.feedback, feedbackObjects(*this, axis), axis.pdo_objects);
  }
  traffic.sync_bytes = buses.at(static_cast<std::size_t>(bus)).sync_counter != 0 ? 1 : 0;
  traffic.guard_period = 1e-3 * guardTime(heartbeat_budget);
  traffic.heartbeat_period = node_heartbeat;
  traffic.master_heartbeat_period = heartbeat_budget / kHeartbeatsPerBudget;
  for (int cycles = 1; cycles <= kLongestRequestInterval; ++cycles) {
    traffic.request_interval = cycles * period;
    if (computeLoad(planWith(*this, bus, traffic)).fits)
      break;
  }
  return traffic;
}

BusPlan HardwareConfig::planOf(int bus, double heartbeat_budget) const {
  return planWith(*this, bus, trafficOf(bus, heartbeat_budget));
}

int guardTime(double heartbeat_budget) noexcept {
  return std::max(1, static_cast<int>(1e3 * heartbeat_budget / kGuardsPerBudget));
}

double AxisConfig::stopBudget() const noexcept {
  constexpr double kMargin = 0.1;  // s: for the motor's lag, and the transitions
  return 2.0 * velocity / quick_stop_deceleration + (brake ? brake->closing_time : 0.0) + kMargin;
}

double AxisConfig::travelWithoutHal(ProtectionMask lost, double heartbeat_budget) const noexcept {
  constexpr double kLag = 0.02;  // s: of the drive's loops, and of its position when the HAL closes the loop
  const auto lacks = [lost](Protection protection) { return (lost & bit(protection)) != 0; };
  const bool deadline = !lacks(Protection::kCommandDeadline);
  if ((!deadline && lacks(Protection::kHeartbeatWatch)) || lacks(Protection::kConnectionReaction) ||
      lacks(Protection::kQuickStopRamp))
    return std::numeric_limits<double>::infinity();
  const double notices = deadline ? kDeadlineShare * heartbeat_budget : heartbeat_budget;
  return velocity * (notices + kLag) + velocity * velocity / (2.0 * quick_stop_deceleration);
}

bool readsInputs(const HardwareConfig& hardware, const AxisConfig& axis) noexcept {
  const auto of_axis = [&](const EmergencyInput& input) {
    const AxisConfig& of = hardware.axes[static_cast<std::size_t>(input.axis)];
    return !input.statusword && of.bus == axis.bus && of.node == axis.node;
  };
  return axis.hasSwitches() || std::ranges::any_of(hardware.emergency_stop, of_axis);
}

bool holdsWithoutPower(const HardwareConfig& hardware, int arm) noexcept {
  return std::none_of(hardware.axes.begin(), hardware.axes.end(), [arm](const AxisConfig& axis) {
    return axis.arm == arm && axis.powerless_hold == HoldingMeans::kNo;
  });
}

safety::ArmLimits cutLimits(const safety::ArmLimits& robot, const std::vector<AxisConfig>& axes, int arm) {
  safety::ArmLimits limits = robot;
  for (const AxisConfig& axis : axes) {
    if (axis.arm != arm)
      continue;
    safety::JointLimit& joint = limits.joints.at(static_cast<std::size_t>(axis.joint));
    joint.lower = std::max(joint.lower, axis.lower);
    joint.upper = std::min(joint.upper, axis.upper);
    joint.velocity = std::min(joint.velocity, axis.velocity);
    joint.slew_limit = std::min(joint.slew_limit, axis.slew_limit);
  }
  for (std::size_t j = 0; j < limits.joints.size(); ++j) {
    const safety::JointLimit& joint = limits.joints[j];
    const std::string who = "joint " + std::to_string(j + 1);
    if (!std::isfinite(joint.lower) || !std::isfinite(joint.upper) || !std::isfinite(joint.velocity))
      throw std::invalid_argument(
          who +
          ": found limits of position or speed that are not finite, in the robot and in the hardware file; "
          "expected finite ones in one of them");
    if (!(joint.lower < joint.upper))
      throw std::invalid_argument(who + ": the lower limit " + std::to_string(joint.lower) +
                                  " is not below the upper limit " + std::to_string(joint.upper) +
                                  " (m or rad) after the limits of robot and drive are combined");
  }
  return limits;
}

}  // namespace tandem::hal
