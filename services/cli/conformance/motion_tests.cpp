// SPDX-License-Identifier: Apache-2.0
/** @file Conformance tests of accepted commands: enable, follow, hold, pause, disable, speed limit. */
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "operation/convert.h"
#include "services/cli/conformance/verdict.h"

namespace tandem::cli {
namespace {

using safety::DriveRequest;
using safety::OperatingState;

void setRequest(DriveRequest request, Commander::Command& command) {
  command.request.fill(static_cast<std::uint8_t>(request));
}

/// The first setpoint is the measured position.
void requireSetpointAtPosition(const Commander& commander, const dds::ActuationState& state, Verdict& verdict) {
  commander.forEachJoint([&](int arm, int joint, std::size_t i) {
    const double distance = std::abs(state.setpoint[i] - state.position[i]);
    verdict.require(distance <= commander.stillness(arm, joint),
                    "the first setpoint within " + amount(commander, arm, joint, commander.stillness(arm, joint)) +
                        " of the measured position",
                    commander.nameOf(arm, joint) + " " + amount(commander, arm, joint, distance) + " from it");
  });
}

Verdict enable(Commander& commander) {
  Verdict verdict;
  disableAll(commander);
  const dds::ActuationState before = commander.state();
  commander.forget();
  // Motion in the command that enables is ignored.
  Commander::Command first = commander.next();
  commander.slowly()(first);
  setRequest(DriveRequest::kEnable, first);
  commander.send(first);
  commander.silence(commander.period());
  commander.request(DriveRequest::kEnable, OperatingState::kEnabled);
  requireSetpointAtPosition(commander, commander.state(), verdict);
  commander.stream(shortTime(commander));
  requireState(commander, OperatingState::kEnabled, 0, verdict);
  requireStill(commander, before, commander.seen(), verdict);
  verdict.note("the setpoint begins at the measured position; nothing moves");
  return verdict;
}

Verdict follow(Commander& commander) {
  Verdict verdict;
  enableAll(commander);
  const Commander::Change moving = commander.slowly();
  Commander::Command sample = commander.next();
  moving(sample);
  commander.forget();
  commander.stream(commander.slow().seconds, moving);
  const States states = commander.seen();
  requireState(commander, OperatingState::kEnabled, 0, verdict);
  // From 30 to 90 % of the time: neither start nor end of the motion.
  const std::int64_t start = states.front().at, time = states.back().at - start;
  const auto at = [&](double share) {
    return std::ranges::find_if(states, [&](const SeenState& seen) {
      return static_cast<double>(seen.at - start) >= share * static_cast<double>(time);
    });
  };
  const auto from = at(0.3), to = at(0.9);
  const double seconds = 1e-9 * static_cast<double>(to->state.stamp - from->state.stamp);
  int moved = 0;
  std::string without;
  commander.forEachJoint([&](int arm, int joint, std::size_t i) {
    const double asked = sample.velocity[i];
    if (asked == 0.0) {
      without += (without.empty() ? "" : ", ") + commander.nameOf(arm, joint);
      return;
    }
    ++moved;
    const double found = (to->state.position[i] - from->state.position[i]) / seconds;
    double reported = 0.0;
    for (auto each = from; each != to; ++each)
      reported += each->state.velocity[i] / static_cast<double>(to - from);
    const double slack = 0.1 * std::abs(asked) + commander.stillness(arm, joint) / seconds;
    const std::string expected = amount(commander, arm, joint, asked) + "/s";
    verdict.require(std::abs(found - asked) <= slack, expected,
                    commander.nameOf(arm, joint) + " moves at " + amount(commander, arm, joint, found) + "/s");
    verdict.require(std::abs(reported - asked) <= 0.5 * std::abs(asked) + slack, "a reported velocity of " + expected,
                    commander.nameOf(arm, joint) + " " + amount(commander, arm, joint, reported) + "/s");
  });
  verdict.require(moved > 0, "a joint with room to move", "none");
  verdict.note(fmt::format("{} joints move as commanded", moved));
  if (!without.empty())
    verdict.note("no room: " + without);
  return verdict;
}

/** Motion that a command ends in the regular way: stops within a period and the ramp, and ends in `state`. */
Verdict endsIn(Commander& commander, OperatingState state, const Commander::Change& end) {
  Verdict verdict;
  startMotion(commander);
  const dds::ActuationState before = commander.state();
  commander.forget();
  commander.stream(shortTime(commander), end);
  requireState(commander, state, 0, verdict);
  requireWithin(commander, before, commander.seen(), stopWithin(commander), verdict);
  requireStanding(commander, commander.seen(), verdict);
  return verdict;
}

Verdict hold(Commander& commander) {
  Verdict verdict = endsIn(commander, OperatingState::kEnabled, {});
  verdict.note("standstill within a period and the ramp, ENABLED");
  return verdict;
}

Verdict disable(Commander& commander) {
  Verdict verdict = endsIn(commander, OperatingState::kDisabled, [&, moving = commander.slowly()](auto& command) {
    moving(command);
    setRequest(DriveRequest::kDisable, command);
  });
  verdict.note("standstill within a period and the ramp, DISABLED");
  return verdict;
}

Verdict pause(Commander& commander) {
  const Commander::Change moving = commander.slowly();
  Verdict verdict = endsIn(commander, OperatingState::kPaused, [&](auto& command) {
    moving(command);
    setRequest(DriveRequest::kPause, command);
  });
  const dds::ActuationState before = commander.state();
  commander.forget();
  commander.stream(shortTime(commander), [&](auto& command) {
    moving(command);
    setRequest(DriveRequest::kEnable, command);
  });
  requireState(commander, OperatingState::kPaused, 0, verdict);
  Commander::Command resume = commander.next();  // its motion is ignored
  moving(resume);
  setRequest(DriveRequest::kResume, resume);
  commander.send(resume);
  commander.silence(commander.period());
  commander.stream(shortTime(commander));
  requireState(commander, OperatingState::kEnabled, 0, verdict);
  requireStill(commander, before, commander.seen(), verdict);
  verdict.note("no motion while PAUSED; `enable` is refused; `resume` alone moves nothing");
  return verdict;
}

/// Three times the largest speed where it and the joint's room permit that; 0 otherwise.
double excessiveSpeed(const Commander& commander, const dds::ActuationState& state, int arm, int joint) {
  const safety::ArmLimits& limits = commander.robot().arms[static_cast<std::size_t>(arm)].limits;
  const safety::JointLimit& limit = limits.joints[static_cast<std::size_t>(joint)];
  const double way = limit.velocity * commander.period();
  const double speed = std::min(3.0 * limit.velocity, 0.9 * limit.max_step / commander.period());
  if (!std::isfinite(speed) || speed < 1.5 * limit.velocity)
    return 0.0;
  for (const double sign : {1.0, -1.0}) {
    safety::ArmVector there = dds::jointsOf(state.setpoint, arm, limits.jointCount());
    there[joint] += sign * 4.0 * way;
    if (safety::largestViolation(limits, there) <= 0.0)
      return sign * speed;
  }
  return 0.0;
}

std::uint64_t speedActions(const Commander& commander) {
  const dds::HalStatus status = commander.status();
  return status.guard_count[static_cast<std::size_t>(safety::Guard::kVelocity)] +
         status.guard_count[static_cast<std::size_t>(safety::Guard::kSlew)];
}

Verdict speed(Commander& commander) {
  Verdict verdict;
  enableAll(commander);
  const dds::ActuationState before = commander.state();
  const std::uint64_t actions = speedActions(commander);
  commander.forget();
  Commander::Command fast = commander.next();
  int joints = 0;
  for (std::size_t k = 0; k < commander.robot().arms.size(); ++k) {
    // One joint of each arm: neighbours could meet.
    for (int j = 0; j < commander.robot().arms[k].jointCount(); ++j) {
      const double speed = excessiveSpeed(commander, before, static_cast<int>(k), j);
      if (speed == 0.0)
        continue;
      fast.velocity[dds::jointIndex(static_cast<int>(k), j)] = speed;
      fast.moving[k] = 1;
      ++joints;
      break;
    }
  }
  if (joints == 0) {
    verdict.note("no joint has a speed limit and room to exceed it");
    return verdict;
  }
  commander.send(fast);
  commander.silence(commander.period());
  commander.stream(std::max(shortTime(commander), 2.0 * commander.deployment().status_period));
  requireState(commander, OperatingState::kEnabled, 0, verdict);
  const Permitted stop = stopWithin(commander);
  requireWithin(
      commander, before, commander.seen(),
      [&](int arm, int joint, std::size_t i) {
        const safety::ArmLimits& limits = commander.robot().arms[static_cast<std::size_t>(arm)].limits;
        const safety::JointLimit& limit = limits.joints[static_cast<std::size_t>(joint)];
        const double v = fast.velocity[i] == 0.0 ? 0.0 : limit.velocity;
        return v * (commander.period() + v / (2.0 * limit.stop_deceleration)) + stop(arm, joint, i);
      },
      verdict);
  verdict.require(speedActions(commander) > actions, "hal/status counts the gate's action (velocity or slew)",
                  "no count");
  verdict.note(fmt::format("{} joints held at their speed limit, and counted", joints));
  return verdict;
}

}  // namespace

std::vector<ConformanceTest> motionTests() {
  return {
      {"enable", "enabling does not jump", enable},
      {"follow", "follows a slow velocity", follow},
      {"hold", "`moving` 0 ends the motion, ENABLED", hold},
      {"pause", "`pause` and `resume`", pause},
      {"disable", "`disable` ends the motion, DISABLED", disable},
      {"speed", "speed limits are held", speed},
  };
}

}  // namespace tandem::cli
