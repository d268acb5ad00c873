// SPDX-License-Identifier: Apache-2.0
#include "services/cli/recordings/resimulation.h"

#include <cmath>
#include <deque>
#include <iostream>
#include <map>
#include <optional>

#include "services/cli/subcommand.h"
#include "services/dds/raw.h"
#include "services/recordings/recorded_system.h"
#include "services/simulation/sim_core.h"

namespace tandem::cli {
namespace {

/** Recorded inputs and outputs of the simulator. */
struct Run {
  std::map<std::uint64_t, dds::ActuationState> states;             ///< by sequence
  std::map<std::uint64_t, dds::ActuationCommand> commands;         ///< by sequence
  std::deque<std::pair<std::uint64_t, dds::SimRequest>> requests;  ///< with their log times
  std::deque<std::uint64_t> stops;
  std::map<std::uint64_t, std::uint64_t> state_times;  ///< log times by sequence
  recording::Channel state_channel;
};

template <class M>
std::optional<M> decode(Recording& recording, const recording::Channel& channel, const recording::Message& message) {
  const std::optional<std::string> bytes = recording.today(channel, message.data);
  return bytes ? dds::decode<M>(*bytes) : std::nullopt;
}

Run readRun(Recording& recording) {
  Run run;
  std::uint64_t session = 0;
  recording.reader().forEach({}, [&](const recording::Channel& channel, const recording::Message& message) {
    const std::string topic = recording.topicOf(channel);
    if (topic == dds::kActuationState.name) {
      const auto state = decode<dds::ActuationState>(recording, channel, message);
      if (state && session != 0 && state->session != session)
        throw Failure(kUsage,
                      "found states of several simulators in the recording, expected one: record each run of the "
                      "system in a file of its own");
      if (state && run.states.emplace(state->sequence, *state).second) {
        session = state->session;
        run.state_channel = channel;
        run.state_times[state->sequence] = message.log_time;
      }
    } else if (topic == dds::kActuationCommand.name) {
      if (const auto command = decode<dds::ActuationCommand>(recording, channel, message))
        run.commands.emplace(command->sequence, *command);
    } else if (topic == dds::kSimRequest.name) {
      if (const auto request = decode<dds::SimRequest>(recording, channel, message))
        run.requests.emplace_back(message.log_time, *request);
    } else if (topic == dds::kStop.name) {
      run.stops.push_back(message.log_time);
    }
    return true;
  });
  if (run.states.empty())
    throw Failure(kUsage, "found no actuation/state in the recording, expected all topics: record without --topics");
  if (run.states.begin()->second.lock_step == 0)
    throw Failure(kUsage,
                  "found a recording in real time, expected one of a deployment with clock: lock_step (results in real "
                  "time depend on "
                  "timing)");
  return run;
}

/** A new simulator, stepped with the recorded inputs from state to state. */
class Replica {
 public:
  Replica(Recording& recording, Run& run, const runtime::Setup& setup) : recording_(recording), run_(run), sim_(setup) {
    sim_.state(0, state_);
  }

  /// Advances to the recorded state. @return whether the states are identical; empty if undecidable: the inputs precede
  /// the recording, and nothing has moved yet.
  std::optional<bool> follow(const dds::ActuationState& recorded) {
    const bool whole = recorded.sequence == 1 || (recorded.sequence == state_.sequence + 1 && feed(recorded));
    if (!whole && moved_)
      throw Failure(kUsage,
                    "state " + std::to_string(recorded.sequence) +
                        ", or the command that it answers, is missing in the recording; record all topics again, from "
                        "before the first motion");
    while (state_.sequence < recorded.sequence)
      sim_.state(0, state_);
    before_ = recorded;
    if (!whole)
      return std::nullopt;
    state_.fingerprint = recorded.fingerprint;  // written by the bus, not by the simulator
    const auto simulated = asRecorded(state_);
    return simulated && simulated == asRecorded(recorded);
  }
  const dds::ActuationState& state() const { return state_; }

 private:
  /// @return whether the inputs that led to the recorded state are in the recording.
  bool feed(const dds::ActuationState& recorded) {
    if (recorded.answers_command != before_.answers_command) {
      const auto command = run_.commands.find(recorded.answers_command);
      if (command == run_.commands.end())
        return false;
      sim_.onCommand(command->second, 0);
      moved_ = moved_ || command->second.advance != 0;
      return true;
    }
    const std::uint64_t time = run_.state_times.at(recorded.sequence);
    const bool stop = !run_.stops.empty() && run_.stops.front() <= time;
    const bool request = !run_.requests.empty() && run_.requests.front().first <= time;
    if (stop && (!request || run_.stops.front() < run_.requests.front().first)) {
      run_.stops.pop_front();
      sim_.onStop();
    } else if (!run_.requests.empty()) {
      sim_.onRequest(run_.requests.front().second);
      run_.requests.pop_front();
    } else {
      return false;
    }
    return true;
  }

  /// Encoded with the members that the recorded type has.
  std::optional<std::string> asRecorded(const dds::ActuationState& state) {
    return recording_.back(run_.state_channel, dds::encode(state));
  }

  Recording& recording_;
  Run& run_;
  simulation::SimCore sim_;
  dds::ActuationState state_, before_;
  bool moved_ = false;
};

}  // namespace

int resimulate(Recording& recording) {
  Run run = readRun(recording);
  runtime::Setup setup;
  setup.name = "sim";
  try {
    recordings::RecordedSystem system =
        recordings::readSystem(recording.reader(), recordings::RecordedHardware::kLeaveOut);
    setup.deployment = std::move(system.deployment);
    setup.robot = std::move(system.robot);
  } catch (const std::invalid_argument& refused) {
    throw Failure(kUsage, recording.reader().file().string() + ": " + refused.what());
  }
  setup.session = run.states.begin()->second.session;
  Replica replica(recording, run, setup);
  std::uint64_t compared = 0, different = 0;
  double largest = 0.0;
  for (const auto& [sequence, recorded] : run.states) {
    const std::optional<bool> same = replica.follow(recorded);
    if (!same)
      continue;
    ++compared;
    if (!*same && different++ == 0)
      std::cerr << "state " << sequence << " is the first one that differs\n";
    for (std::size_t j = 0; j < recorded.position.size(); ++j)
      largest = std::max(largest, std::abs(replica.state().position[j] - recorded.position[j]));
  }
  std::cout << compared << " states simulated again, " << different << " differ; largest difference of a position "
            << largest << " m or rad\n";
  if (compared == 0)
    throw Failure(kUsage, "no state could be compared: the recording contains no commands");
  return different == 0 && !recording.reportDamage() ? kOk : kFailure;
}

}  // namespace tandem::cli
