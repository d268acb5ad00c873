// SPDX-License-Identifier: Apache-2.0
#include "services/cli/conformance/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tandem::cli {
namespace {

constexpr double kStandingTime = 0.2;  // s

std::string stateText(const Commander& commander, const dds::ActuationState& state, int arm) {
  const auto k = static_cast<std::size_t>(arm);
  const auto operating = static_cast<safety::OperatingState>(state.operating_state[k]);
  const std::string faults = state.faults[k] == 0 ? "" : " (" + safety::describeFaults(state.faults[k]) + ")";
  return commander.robot().arms[k].name + " " + std::string(safety::name(operating)) + faults;
}

}  // namespace

void Verdict::require(bool met, const std::string& expected, const std::string& found) {
  if (met || !passed_)
    return;
  passed_ = false;
  expected_ = expected;
  found_ = found;
}

std::string amount(const Commander& commander, int arm, int joint, double value) {
  return commander.isTranslation(arm, joint) ? fmt::format("{:.3g} mm", 1e3 * value) : fmt::format("{:.3g} rad", value);
}

void requireWithin(const Commander& commander,
                   const dds::ActuationState& from,
                   const States& states,
                   const Permitted& permitted,
                   Verdict& verdict,
                   const Arms& arms) {
  commander.forEachJoint([&](int arm, int joint, std::size_t i) {
    if (arms && !arms(arm))
      return;
    double farthest = 0.0;
    for (const SeenState& seen : states) {
      const double way = std::abs(seen.state.position[i] - from.position[i]);
      farthest = std::isfinite(way) ? std::max(farthest, way) : way;
    }
    const double allowed = permitted(arm, joint, i);
    verdict.require(farthest <= allowed, "at most " + amount(commander, arm, joint, allowed),
                    commander.nameOf(arm, joint) + " moved " + amount(commander, arm, joint, farthest));
  });
}

void requireStill(const Commander& commander, const dds::ActuationState& from, const States& states, Verdict& verdict) {
  requireWithin(
      commander, from, states, [&](int arm, int joint, std::size_t) { return commander.stillness(arm, joint); },
      verdict);
}

void requireStanding(const Commander& commander, const States& states, Verdict& verdict, const Arms& arms) {
  if (states.empty()) {
    verdict.require(false, "states", "none");
    return;
  }
  const std::int64_t end = states.back().at;
  const auto late = std::ranges::find_if(
      states, [&](const SeenState& seen) { return 1e-9 * static_cast<double>(end - seen.at) <= kStandingTime; });
  const States last(late, states.end());
  Verdict standing;
  requireWithin(
      commander, last.front().state, last,
      [&](int arm, int joint, std::size_t) { return commander.stillness(arm, joint); }, standing, arms);
  verdict.require(standing.passed(), "standstill", standing.found() + " in the last 0.2 s");
}

void requireState(const Commander& commander,
                  safety::OperatingState state,
                  safety::FaultMask faults,
                  Verdict& verdict,
                  const Arms& arms) {
  const dds::ActuationState last = commander.state();
  for (int arm = 0; arm < static_cast<int>(commander.robot().arms.size()); ++arm) {
    if (arms && !arms(arm))
      continue;
    const auto k = static_cast<std::size_t>(arm);
    const bool met = last.operating_state[k] == static_cast<std::uint8_t>(state) && (last.faults[k] & faults) == faults;
    const std::string of = faults == 0 ? "" : " (" + safety::describeFaults(faults) + ")";
    verdict.require(met, std::string(safety::name(state)) + of, stateText(commander, last, arm));
  }
}

Permitted stopWithin(const Commander& commander) {
  constexpr double kLag = 0.05;  // s
  double ramp = 0.0;
  commander.forEachJoint([&](int arm, int joint, std::size_t i) {
    const safety::ArmLimits& limits = commander.robot().arms[static_cast<std::size_t>(arm)].limits;
    ramp = std::max(ramp, commander.slow().speed[i] / limits.joints[static_cast<std::size_t>(joint)].stop_deceleration);
  });
  return [&commander, ramp](int arm, int joint, std::size_t i) {
    return commander.slow().speed[i] * (commander.period() + 0.5 * ramp + kLag) + commander.stillness(arm, joint);
  };
}

double shortTime(const Commander& commander) { return std::max(0.5, 5.0 * commander.period()); }

void disableAll(Commander& commander) {
  commander.request(safety::DriveRequest::kDisable, safety::OperatingState::kDisabled, 60.0);
  // Commands that did not count left gaps in the stream, which count as losses until a command is taken without power.
  constexpr double kTaken = 0.02;  // s: several periods of the drives
  commander.stream(std::max(kTaken, commander.period()));
}

void enableAll(Commander& commander) {
  disableAll(commander);
  commander.request(safety::DriveRequest::kEnable, safety::OperatingState::kEnabled);
  commander.stream(2.0 * commander.period());
}

Commander::Change startMotion(Commander& commander) {
  enableAll(commander);
  const Commander::Change moving = commander.slowly();
  commander.forget();
  commander.stream(0.5 * commander.slow().seconds, moving);
  return moving;
}

std::vector<ConformanceTest> conformanceTests() {
  std::vector<ConformanceTest> all;
  for (const auto& part : {statesTests(), motionTests(), stopTests(), streamTests(), limitTests()})
    all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace tandem::cli
