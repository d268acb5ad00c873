// SPDX-License-Identifier: Apache-2.0
/** @file Experiment runner: executes motions by running services, and collects their messages for rows of a table. */
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "services/cli/subcommand.h"
#include "services/client/client.h"

namespace tandem::cli {

/** A run that cannot be continued; the next one can. */
class RunEnded : public Failure {
 public:
  explicit RunEnded(const std::string& why) : Failure(kFailure, why) {}
};

/** Messages of the periodic topics, by sequence. */
struct RunMessages {
  std::deque<dds::PlanningReference> references;        ///< in order of arrival
  std::map<std::uint64_t, dds::ActuationState> states;  ///< in real time the last 4096
  /// Statuses with a solution, by the state that they answer; in real time by the reference.
  std::map<std::uint64_t, dds::ControlStatus> statuses;
  std::map<std::uint64_t, std::uint64_t> gate_actions;  ///< since start, by the state that they belong to
  std::map<std::uint64_t, dds::TipPoses> tips;          ///< true poses in lock-step, by the state that they belong to
};

/** A client with the control lease that starts motions and collects messages, in lock-step or in real time. */
class ExperimentRunner {
 public:
  /// Connects and takes the control lease. @param interrupted  ends waiting: a process died or the user asked.
  /// @param tips  collects true tip poses in lock-step
  ExperimentRunner(const config::Deployment& deployment, std::function<bool()> interrupted, bool tips);
  ~ExperimentRunner();

  client::Client& client() { return *client_; }
  bool lockStep() const { return lock_step_; }

  /// Drops all messages so far. @return gate actions until now
  std::uint64_t forget();
  /// Starts a motion. @param text  YAML of a trajectory or path  @return its id  @throw client::Refusal
  std::uint32_t start(const std::string& text);
  /// Waits until `take`, which is called with the messages locked, returns true. @return false: not for `seconds`
  bool collect(double seconds, const std::function<bool(RunMessages&)>& take);
  /// @param reached  of the run: "after iteration 12"  @throw Failure, always
  [[noreturn]] void failWithoutProgress(double seconds, const std::string& reached) const;

 private:
  std::mutex mutex_;
  RunMessages messages_;
  bool lock_step_;
  std::unique_ptr<client::Client> client_;
};

}  // namespace tandem::cli
