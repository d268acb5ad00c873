// SPDX-License-Identifier: Apache-2.0
/** @file Conformance tests at joint limits and coupled limits: one joint travels to the nearest one, and back. */
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "operation/convert.h"
#include "safety/joint_motion.h"
#include "services/cli/conformance/limits.h"
#include "services/cli/conformance/verdict.h"

namespace tandem::cli {
namespace {

constexpr double kClear = 1e-3;  // m, rad: how much farther than the limit under test every other one is

double distanceToBox(const safety::ArmLimits& limits, const safety::ArmVector& q, int joint, double sign) {
  const safety::JointLimit& limit = limits.joints[static_cast<std::size_t>(joint)];
  return sign > 0.0 ? limit.upper - q[joint] : q[joint] - limit.lower;
}

/// Distance to the nearest row that the joint leaves in this direction; of its own, as the outer joint, or of others.
double distanceToRow(const safety::ArmLimits& limits, const safety::ArmVector& q, int joint, double sign, bool own) {
  double nearest = safety::kUnlimited;
  for (const safety::LinearRow& row : limits.rows) {
    const double slope = sign * row.a[joint];
    if (slope > 0.0 && (row.outer_joint == joint) == own)
      nearest = std::min(nearest, (row.b - safety::rowValue(row, q)) / slope);
  }
  return nearest;
}

double speedOf(const safety::ArmLimits& limits, int joint) {
  constexpr double kShare = 0.9;
  return kShare * std::min(safety::moveVelocity(limits, joint), limits.isTranslation(joint)
                                                                    ? safety::kMoveTranslationVelocity
                                                                    : safety::kMoveRotationVelocity);
}

/// Moves one joint only.
Commander::Change movement(const LimitTravel& travel, double velocity) {
  return [=](Commander::Command& command) {
    command.velocity[dds::jointIndex(travel.arm, travel.joint)] = velocity;
    command.moving[static_cast<std::size_t>(travel.arm)] = 1;
  };
}

void requireInside(const Commander& commander, int arm, const States& states, Verdict& verdict) {
  constexpr double kRounding = 1e-6;  // m, rad
  const config::Arm& of = commander.robot().arms[static_cast<std::size_t>(arm)];
  double setpoint = 0.0, position = 0.0, tolerance = 0.0;
  for (int j = 0; j < of.jointCount(); ++j)
    tolerance = std::max(tolerance, commander.stillness(arm, j));
  for (const SeenState& seen : states) {
    setpoint = std::max(setpoint,
                        safety::largestViolation(of.limits, dds::jointsOf(seen.state.setpoint, arm, of.jointCount())));
    position = std::max(position,
                        safety::largestViolation(of.limits, dds::jointsOf(seen.state.position, arm, of.jointCount())));
  }
  verdict.require(setpoint <= kRounding, "setpoints inside the limits",
                  fmt::format("{:.3g} m or rad outside", setpoint));
  verdict.require(position <= tolerance, fmt::format("joints up to {:.3g} m or rad outside the limits", tolerance),
                  fmt::format("{:.3g}", position));
}

Verdict travelToLimit(Commander& commander, bool coupled) {
  Verdict verdict;
  enableAll(commander);
  const std::optional<LimitTravel> travel = nearestLimit(commander.robot(), commander.state(), coupled);
  if (!travel) {
    verdict.note("this robot has none that one joint can reach alone");
    return verdict;
  }
  const auto guard = static_cast<std::size_t>(coupled ? safety::Guard::kCoupledRow : safety::Guard::kPosition);
  const std::uint64_t count = commander.status().guard_count[guard];
  const double velocity = travel->velocity;
  commander.forget();
  commander.stream(travel->seconds() + shortTime(commander), movement(*travel, velocity));
  commander.stream(std::max(shortTime(commander), 2.0 * commander.deployment().status_period));
  const States states = commander.seen();
  requireState(commander, safety::OperatingState::kEnabled, 0, verdict);
  requireInside(commander, travel->arm, states, verdict);
  requireStanding(commander, states, verdict);
  const std::size_t i = dds::jointIndex(travel->arm, travel->joint);
  const double way = std::abs(states.back().state.position[i] - states.front().state.position[i]);
  const double slack = 0.1 * travel->distance + commander.stillness(travel->arm, travel->joint);
  verdict.require(way >= travel->distance - slack, describe(*travel, commander.robot()),
                  amount(commander, travel->arm, travel->joint, way));
  verdict.require(commander.status().guard_count[guard] > count, "hal/status counts the gate's action", "no count");
  verdict.note(describe(*travel, commander.robot()) + ", held there");
  if (verdict.passed())
    commander.stream(travel->seconds(), movement(*travel, -velocity));
  return verdict;
}

}  // namespace

double LimitTravel::seconds() const { return 1.05 * distance / std::abs(velocity) + 0.5; }

std::string describe(const LimitTravel& travel, const config::Robot& robot) {
  const config::Arm& arm = robot.arms[static_cast<std::size_t>(travel.arm)];
  const bool translation = arm.limits.isTranslation(travel.joint);
  const auto text = [&](double value) {
    return translation ? fmt::format("{:.3g} mm", 1e3 * value) : fmt::format("{:.3g} rad", value);
  };
  return fmt::format("{} {} travels {} to its {}limit at {}/s", arm.name,
                     arm.joint_names[static_cast<std::size_t>(travel.joint)], text(travel.distance),
                     travel.coupled ? "coupled " : "", text(std::abs(travel.velocity)));
}

std::optional<LimitTravel> nearestLimit(const config::Robot& robot, const dds::ActuationState& state, bool coupled) {
  std::optional<LimitTravel> nearest;
  double shortest = safety::kUnlimited;
  for (int arm = 0; arm < static_cast<int>(robot.arms.size()); ++arm) {
    const safety::ArmLimits& limits = robot.arms[static_cast<std::size_t>(arm)].limits;
    const safety::ArmVector q = dds::jointsOf(state.setpoint, arm, limits.jointCount());
    for (int joint = 0; joint < limits.jointCount(); ++joint) {
      const double speed = speedOf(limits, joint);
      for (const double sign : {1.0, -1.0}) {
        const double box = distanceToBox(limits, q, joint, sign);
        const double row = distanceToRow(limits, q, joint, sign, true);
        const double carried = distanceToRow(limits, q, joint, sign, false);
        const double wanted = coupled ? row : box, other = std::min(coupled ? box : row, carried);
        if (!std::isfinite(wanted) || other < wanted + kClear || wanted / speed >= shortest)
          continue;
        shortest = wanted / speed;
        nearest = LimitTravel{arm, joint, std::max(0.0, wanted), sign * speed, coupled};
      }
    }
  }
  return nearest;
}

std::vector<ConformanceTest> limitTests() {
  return {
      {"limit", "joint limits are held", [](Commander& c) { return travelToLimit(c, false); }, true},
      {"coupled", "coupled limits are held", [](Commander& c) { return travelToLimit(c, true); }, true},
  };
}

}  // namespace tandem::cli
