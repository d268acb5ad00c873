// SPDX-License-Identifier: Apache-2.0
/** @file Conformance tests without motion: identity, states, start, timing. */
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "config/values.h"
#include "services/cli/conformance/verdict.h"
#include "services/runtime/identity.h"

namespace tandem::cli {
namespace {

/// Percentile of unordered values, s.
double percentile(std::vector<double> values, double share) {
  if (values.empty())
    return 0.0;
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

std::string percentiles(const std::vector<double>& values) {
  return fmt::format("{:.2f} ms (median), {:.2f} ms (99 %), {:.2f} ms (max)", 1e3 * percentile(values, 0.5),
                     1e3 * percentile(values, 0.99), 1e3 * percentile(values, 1.0));
}

bool isHere(const dds::Identity& identity) {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return identity.host == name.data();
}

Verdict identity(Commander& commander) {
  Verdict verdict;
  const std::vector<dds::Identity> drives = commander.drives();
  std::string names;
  for (const dds::Identity& each : drives)
    names += (names.empty() ? "" : ", ") + runtime::describe(each);
  verdict.require(drives.size() == 1, "one process of the role hal", names.empty() ? "none" : names);
  if (!verdict.passed())
    return verdict;
  const dds::Identity& found = drives.front();
  const std::uint64_t ours = runtime::fingerprintOf(commander.deployment());
  verdict.require(found.fingerprint == ours, "fingerprint " + config::fingerprintText(ours),
                  config::fingerprintText(found.fingerprint));
  verdict.require(found.robot == commander.robot().name, "robot " + commander.robot().name, found.robot);
  verdict.require(found.moves == 1, "moves 1", "moves 0");
  const dds::ActuationState state = commander.state();
  const std::size_t arms = commander.robot().arms.size();
  verdict.require(state.arm_count == arms, fmt::format("{} arms", arms), fmt::format("{} arms", state.arm_count));
  for (std::size_t k = 0; k < arms; ++k) {
    const int joints = commander.robot().arms[k].jointCount();
    verdict.require(state.joint_count[k] == joints,
                    fmt::format("{} joints of {}", joints, commander.robot().arms[k].name),
                    fmt::format("{}", state.joint_count[k]));
  }
  verdict.require(state.lock_step == 0, "lock_step 0", "lock_step 1");
  verdict.note(names + ", fingerprint " + config::fingerprintText(ours));
  return verdict;
}

/// Requires that stamps advance as this host's clock does, and on the same host that they are of the time of sending.
void requireHonestStamps(const Commander& commander, const States& states, Verdict& verdict) {
  const auto seconds = [](std::int64_t from, std::int64_t to) { return 1e-9 * static_cast<double>(to - from); };
  const double stamps = seconds(states.front().state.stamp, states.back().state.stamp);
  const double clock = seconds(states.front().at, states.back().at);
  verdict.require(std::abs(stamps - clock) <= 0.05 + 0.05 * clock,
                  fmt::format("stamps that advance by {:.2f} s", clock), fmt::format("{:.2f} s", stamps));
  const std::vector<dds::Identity> drives = commander.drives();
  if (drives.empty() || !isHere(drives.front()))
    return;
  std::vector<double> ages;
  for (const SeenState& seen : states)
    ages.push_back(seconds(seen.state.stamp, seen.at));
  const double age = percentile(ages, 0.5);
  verdict.require(
      age >= 0.0 && age <= commander.budget(),
      fmt::format("stamps of this host's monotonic clock, not older than {:.0f} ms", 1e3 * commander.budget()),
      fmt::format("stamps {:.3g} s old", age));
}

Verdict states(Commander& commander) {
  constexpr double kSeconds = 2.0;
  Verdict verdict;
  commander.forget();
  commander.silence(kSeconds);
  const States states = commander.seen();
  const dds::HalStatus status = commander.status();
  verdict.require(states.size() > 10, "more than 10 states in 2 s", std::to_string(states.size()));
  if (!verdict.passed())
    return verdict;
  std::vector<double> intervals;
  for (std::size_t n = 1; n < states.size(); ++n) {
    const dds::ActuationState &before = states[n - 1].state, &now = states[n].state;
    intervals.push_back(1e-9 * static_cast<double>(now.stamp - before.stamp));
    verdict.require(now.session == before.session && now.session != 0, "one session, not 0", "another session");
    verdict.require(now.sequence > before.sequence, fmt::format("a sequence above {}", before.sequence),
                    std::to_string(now.sequence));
    verdict.require(now.stamp > before.stamp, "increasing stamps", fmt::format("a step of {:.3g} s", intervals.back()));
  }
  const double median = percentile(intervals, 0.5);
  verdict.require(status.period > 0.0 && std::abs(median - status.period) <= 0.2 * status.period,
                  fmt::format("a state every {:.3g} ms, the period in hal/status", 1e3 * status.period),
                  fmt::format("every {:.3g} ms", 1e3 * median));
  verdict.require(status.period <= commander.period(),
                  fmt::format("a period up to {:.3g} ms", 1e3 * commander.period()),
                  fmt::format("{:.3g} ms", 1e3 * status.period));
  verdict.require(percentile(intervals, 0.99) <= commander.budget(),
                  fmt::format("99 % of the intervals within the budget, {:.0f} ms", 1e3 * commander.budget()),
                  percentiles(intervals));
  requireHonestStamps(commander, states, verdict);
  verdict.note("interval " + percentiles(intervals));
  return verdict;
}

Verdict start(Commander& commander) {
  Verdict verdict;
  for (const SeenState& seen : commander.seen()) {
    for (std::size_t k = 0; k < commander.robot().arms.size(); ++k) {
      const auto state = static_cast<safety::OperatingState>(seen.state.operating_state[k]);
      verdict.require(state == safety::OperatingState::kDisabled, "DISABLED; otherwise start the process anew",
                      commander.robot().arms[k].name + " " + std::string(safety::name(state)));
      verdict.require(seen.state.valid[k] == 1 && seen.state.homed[k] == 1, "valid positions of homed joints",
                      commander.robot().arms[k].name + " is not valid, or not homed");
    }
  }
  const dds::ActuationState before = commander.state();
  commander.forget();
  const Commander::Change moving = commander.slowly();
  commander.stream(shortTime(commander), moving);
  requireState(commander, safety::OperatingState::kDisabled, 0, verdict);
  requireStill(commander, before, commander.seen(), verdict);
  verdict.note("DISABLED; velocities have no effect");
  return verdict;
}

Verdict answers(Commander& commander) {
  Verdict verdict;
  disableAll(commander);
  commander.forget();
  const std::uint64_t first = commander.sequence() + 1;
  commander.stream(std::max(2.0, 20.0 * commander.period()));
  commander.silence(std::min(0.2, commander.budget()));
  std::vector<double> times;
  std::uint64_t answered = first - 1;
  for (const SeenState& seen : commander.seen()) {
    if (seen.state.answers_command <= answered)
      continue;
    answered = seen.state.answers_command;
    times.push_back(1e-9 * static_cast<double>(seen.at - commander.sentAt(answered)));
  }
  verdict.require(answered == commander.sequence(),
                  fmt::format("answers_command {}, of the last command", commander.sequence()),
                  std::to_string(answered));
  verdict.require(percentile(times, 0.99) <= 0.5 * commander.budget(),
                  fmt::format("99 % of the answers within half the budget, {:.0f} ms", 500.0 * commander.budget()),
                  percentiles(times));
  verdict.note(percentiles(times));
  return verdict;
}

}  // namespace

std::vector<ConformanceTest> statesTests() {
  return {
      {"identity", "identity: robot, deployment, arms, joints", identity},
      {"states", "states at their period, sequence, stamps", states},
      {"start", "DISABLED at the start; nothing moves", start},
      {"answers", "time from a command to the state that answers it", answers},
  };
}

}  // namespace tandem::cli
