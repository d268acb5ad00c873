// SPDX-License-Identifier: Apache-2.0
/** @file Conformance tests of commands that a process of the role hal refuses: too old, repeated, foreign. */
#include <cmath>
#include <limits>

#include "services/cli/conformance/verdict.h"

namespace tandem::cli {
namespace {

using safety::bit;
using safety::DriveRequest;
using safety::Fault;
using safety::OperatingState;

/// Change that turns a correct command into a wrong one.
using Spoil = std::function<void(Commander::Command&)>;

/// While DISABLED, a wrong command does not enable.
void requireNoEffect(Commander& commander, const Spoil& spoil, Verdict& verdict) {
  disableAll(commander);
  const dds::ActuationState before = commander.state();
  commander.forget();
  commander.stream(shortTime(commander), [&](Commander::Command& command) {
    command.request.fill(static_cast<std::uint8_t>(DriveRequest::kEnable));
    spoil(command);
  });
  Verdict disabled;
  requireState(commander, OperatingState::kDisabled, 0, disabled);
  verdict.require(disabled.passed(), "DISABLED: a wrong command does not enable", disabled.found());
  requireStill(commander, before, commander.seen(), verdict);
}

/// One wrong command during motion stops the given arms and latches `fault`; correct commands do not move them again.
void requireStop(Commander& commander, const Spoil& spoil, Fault fault, Verdict& verdict, const Arms& arms = {}) {
  const Commander::Change moving = startMotion(commander);
  requireState(commander, OperatingState::kEnabled, 0, verdict);
  const dds::ActuationState before = commander.state();
  commander.forget();
  Commander::Command wrong = commander.next();
  moving(wrong);
  spoil(wrong);
  commander.send(wrong);
  commander.silence(commander.period());
  commander.stream(shortTime(commander), moving);
  requireState(commander, OperatingState::kFault, bit(fault), verdict, arms);
  requireWithin(commander, before, commander.seen(), stopWithin(commander), verdict, arms);
  requireStanding(commander, commander.seen(), verdict, arms);
  verdict.note("moves nothing, stops the arms: FAULT (" + safety::describeFaults(bit(fault)) + ")");
}

Verdict refuses(Commander& commander, const Spoil& spoil, Fault fault) {
  Verdict verdict;
  requireNoEffect(commander, spoil, verdict);
  requireStop(commander, spoil, fault, verdict);
  return verdict;
}

/// Sequence of the newest state that is at least `age` old.
std::uint64_t stateOfAge(const Commander& commander, double age) {
  const std::int64_t now = commander.state().stamp;
  std::uint64_t found = 0;
  for (const SeenState& seen : commander.seen()) {
    if (1e-9 * static_cast<double>(now - seen.state.stamp) >= age)
      found = seen.state.sequence;
  }
  return found;
}

Verdict age(Commander& commander) {
  Verdict verdict;
  enableAll(commander);
  commander.forget();
  commander.stream(commander.budget());
  Commander::Command young = commander.next();
  young.answers_state = stateOfAge(commander, 0.4 * commander.budget());
  commander.send(young);
  commander.silence(commander.period());
  requireState(commander, OperatingState::kEnabled, 0, verdict);
  disableAll(commander);
  commander.silence(1.5 * commander.budget());
  const std::uint64_t old = stateOfAge(commander, 1.5 * commander.budget());
  verdict.require(old != 0, "states for 1.5 budgets", "none so old");
  const Spoil spoil = [old](Commander::Command& command) { command.answers_state = old; };
  requireNoEffect(commander, spoil, verdict);
  requireStop(commander, spoil, Fault::kStaleCommand, verdict);
  return verdict;
}

Verdict unknownState(Commander& commander) {
  return refuses(
      commander, [](Commander::Command& command) { command.answers_state += 1'000'000'000; }, Fault::kStaleCommand);
}

Verdict foreignState(Commander& commander) {
  return refuses(
      commander, [](Commander::Command& command) { command.state_session ^= 1; }, Fault::kStaleCommand);
}

Verdict repeated(Commander& commander) {
  disableAll(commander);
  const std::uint64_t used = commander.sequence();
  return refuses(
      commander, [used](Commander::Command& command) { command.sequence = used; }, Fault::kOutOfSequence);
}

Verdict notFinite(Commander& commander) {
  Verdict verdict;
  // Of the first arm alone: the others go on.
  const auto first = [](int arm) { return arm == 0; };
  for (const double value : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    requireStop(
        commander, [value](Commander::Command& command) { command.velocity[0] = value; }, Fault::kNotFinite, verdict,
        first);
    requireState(commander, OperatingState::kEnabled, 0, verdict, [](int arm) { return arm != 0; });
  }
  return verdict;
}

Verdict arms(Commander& commander) {
  return refuses(
      commander,
      [](Commander::Command& command) {
        command.arm_count = static_cast<std::uint8_t>(command.arm_count == 1 ? 2 : command.arm_count - 1);
      },
      Fault::kUnknownArm);
}

Verdict fingerprint(Commander& commander) {
  return refuses(
      commander, [](Commander::Command& command) { command.fingerprint ^= 1; }, Fault::kMismatch);
}

/// Another session is refused while an arm moves; at standstill it takes over and finds all arms DISABLED.
Verdict session(Commander& commander) {
  Verdict verdict;
  const std::uint64_t other = runtime::randomIdentity();
  requireStop(
      commander,
      [other](Commander::Command& command) {
        command.control_session = other;
        command.sequence = 1;
      },
      Fault::kOutOfSequence, verdict);
  enableAll(commander);
  const dds::ActuationState before = commander.state();
  commander.forget();
  commander.beginSession(other);
  commander.stream(shortTime(commander));
  requireState(commander, OperatingState::kDisabled, 0, verdict);
  const std::uint64_t answered = commander.state().answers_command;
  verdict.require(answered > 0 && answered <= commander.sequence(), "an answer to the new session",
                  "answers_command " + std::to_string(answered));
  requireStill(commander, before, commander.seen(), verdict);
  verdict.note("at standstill the new session takes over and finds all arms DISABLED");
  return verdict;
}

}  // namespace

std::vector<ConformanceTest> streamTests() {
  return {
      {"age", "age of the answered state", age},
      {"unknown", "an answer to a state that was never sent", unknownState},
      {"state-session", "an answer to a state of another session", foreignState},
      {"repeated", "a repeated command", repeated},
      {"not-finite", "a velocity that is not finite", notFinite},
      {"arms", "a command with another number of arms", arms},
      {"session", "a second control session", session},
      {"fingerprint", "a command of another robot or deployment", fingerprint},
  };
}

}  // namespace tandem::cli
