// SPDX-License-Identifier: Apache-2.0
/** @file Conformance tests of stops: silence of control, latched faults, topic stop. */
#include <fmt/format.h>

#include <algorithm>

#include "services/cli/conformance/verdict.h"

namespace tandem::cli {
namespace {

using safety::bit;
using safety::DriveRequest;
using safety::Fault;
using safety::OperatingState;

double seconds(const SeenState& from, const SeenState& to) {
  return 1e-9 * static_cast<double>(to.state.stamp - from.state.stamp);
}

bool inFault(const dds::ActuationState& state, std::size_t arms) {
  return std::all_of(state.operating_state.begin(), state.operating_state.begin() + static_cast<std::ptrdiff_t>(arms),
                     [](std::uint8_t s) { return s == static_cast<std::uint8_t>(OperatingState::kFault); });
}

Verdict silence(Commander& commander) {
  Verdict verdict;
  startMotion(commander);
  const std::uint64_t last = commander.sequence();
  commander.silence(commander.budget() + std::max(1.0, commander.budget()));
  States states = commander.seen();
  const auto taken = std::ranges::find_if(states, [&](const SeenState& s) { return s.state.answers_command >= last; });
  verdict.require(taken != states.end(), fmt::format("answers_command {}", last), "older ones");
  if (!verdict.passed())
    return verdict;
  const SeenState begin = *taken;
  states.erase(states.begin(), taken);
  requireWithin(commander, begin.state, states, stopWithin(commander), verdict);
  requireStanding(commander, states, verdict);
  requireState(commander, OperatingState::kFault, bit(Fault::kCommandTimeout), verdict);
  const auto fault =
      std::ranges::find_if(states, [&](const SeenState& s) { return inFault(s.state, commander.robot().arms.size()); });
  if (fault == states.end())
    return verdict;
  const double after = seconds(begin, *fault), latest = 1.2 * commander.budget() + 0.1;
  verdict.require(after <= latest, fmt::format("FAULT within {:.0f} ms", 1e3 * latest),
                  fmt::format("{:.0f} ms", 1e3 * after));
  verdict.note(fmt::format("FAULT after {:.0f} ms, budget {:.0f} ms", 1e3 * after, 1e3 * commander.budget()));
  return verdict;
}

/// In FAULT: enable, pause and motion have no effect; `disable` leads to DISABLED, and without a new `enable` nothing
/// moves.
Verdict latch(Commander& commander) {
  Verdict verdict;
  enableAll(commander);
  commander.silence(commander.budget() + 1.0,
                    [&](const auto& state) { return inFault(state, commander.robot().arms.size()); });
  requireState(commander, OperatingState::kFault, bit(Fault::kCommandTimeout), verdict);
  const dds::ActuationState before = commander.state();
  commander.forget();
  const Commander::Change moving = commander.slowly();
  for (const DriveRequest request : {DriveRequest::kEnable, DriveRequest::kResume, DriveRequest::kPause}) {
    commander.stream(shortTime(commander), [&](Commander::Command& command) {
      moving(command);
      command.request.fill(static_cast<std::uint8_t>(request));
    });
    requireState(commander, OperatingState::kFault, bit(Fault::kCommandTimeout), verdict);
  }
  disableAll(commander);
  commander.stream(shortTime(commander), moving);
  requireState(commander, OperatingState::kDisabled, 0, verdict);
  requireStill(commander, before, commander.seen(), verdict);
  verdict.note("only `disable` leaves FAULT; nothing moves before the next `enable`");
  return verdict;
}

Verdict stop(Commander& commander) {
  Verdict verdict;
  disableAll(commander);
  commander.publishStop("conformance: stop in DISABLED");
  const auto stopped = [&](const auto& state) { return inFault(state, commander.robot().arms.size()); };
  commander.stream(2.0, {}, stopped);
  requireState(commander, OperatingState::kFault, bit(Fault::kStopRequested), verdict);
  const Commander::Change moving = startMotion(commander);
  const dds::ActuationState before = commander.state();
  commander.forget();
  commander.publishStop("conformance: stop in motion");
  commander.stream(shortTime(commander), moving, stopped);
  // A `disable` that was sent before the fault could be known clears nothing.
  Commander::Command old = commander.next();
  old.answers_state = before.sequence;
  old.request.fill(static_cast<std::uint8_t>(DriveRequest::kDisable));
  commander.send(old);
  commander.silence(commander.period());
  commander.stream(shortTime(commander), moving);
  requireState(commander, OperatingState::kFault, bit(Fault::kStopRequested), verdict);
  const Permitted permitted = stopWithin(commander);
  constexpr double kDelivery = 0.1;  // s
  requireWithin(
      commander, before, commander.seen(),
      [&](int arm, int joint, std::size_t i) {
        return permitted(arm, joint, i) + commander.slow().speed[i] * kDelivery;
      },
      verdict);
  requireStanding(commander, commander.seen(), verdict);
  verdict.note("stops, and latches in every state; a `disable` from before it clears nothing");
  return verdict;
}

}  // namespace

std::vector<ConformanceTest> stopTests() {
  return {
      {"silence", "stops when commands end, and latches", silence},
      {"latch", "a fault latches until `disable`", latch},
      {"stop", "topic stop", stop},
  };
}

}  // namespace tandem::cli
