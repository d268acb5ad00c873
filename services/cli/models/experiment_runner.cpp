// SPDX-License-Identifier: Apache-2.0
#include "services/cli/models/experiment_runner.h"

#include <fmt/format.h>

#include <numeric>
#include <utility>

#include "operation/convert.h"
#include "safety/faults.h"
#include "services/client/motions.h"

namespace tandem::cli {

ExperimentRunner::ExperimentRunner(const config::Deployment& deployment, std::function<bool()> interrupted, bool tips)
    : lock_step_(deployment.clock == config::ClockMode::kLockStep) {
  client::Client::Callbacks callbacks;
  callbacks.state = [this](const dds::ActuationState& m) {
    const std::lock_guard lock(mutex_);
    messages_.states[m.sequence] = m;
    constexpr std::size_t kMostStates = 4096;  // real time has no end
    if (!lock_step_ && messages_.states.size() > kMostStates)
      messages_.states.erase(messages_.states.begin());
  };
  callbacks.status = [this](const dds::ControlStatus& m) {
    const std::lock_guard lock(mutex_);
    if (m.task_count > 0)
      messages_.statuses[lock_step_ ? m.answers_state : m.answers_reference] = m;
  };
  callbacks.reference = [this](const dds::PlanningReference& m) {
    const std::lock_guard lock(mutex_);
    messages_.references.push_back(m);
  };
  if (lock_step_ && tips) {
    callbacks.sim_tips = [this](const dds::TipPoses& m) {
      const std::lock_guard lock(mutex_);
      messages_.tips[m.answers_state] = m;
    };
  }
  callbacks.hal = [this](const dds::HalStatus& m) {
    const std::lock_guard lock(mutex_);
    messages_.gate_actions[m.sequence] = std::accumulate(m.guard_count.begin(), m.guard_count.end(), std::uint64_t{0});
  };
  client_ = std::make_unique<client::Client>(deployment, callbacks);
  client::takeCommand(*client_, std::move(interrupted));
}

ExperimentRunner::~ExperimentRunner() { client::endCommand(*client_); }

std::uint64_t ExperimentRunner::forget() {
  const std::lock_guard lock(mutex_);
  // The counters at the start of a run are the last ones so far.
  auto actions = std::move(messages_.gate_actions);
  messages_ = {};
  if (actions.empty())
    return 0;
  messages_.gate_actions.insert(*actions.rbegin());
  return actions.rbegin()->second;
}

std::uint32_t ExperimentRunner::start(const std::string& text) {
  dds::PlanningRequest request;
  request.kind = static_cast<std::uint8_t>(dds::PlanningKind::kStart);
  request.trajectory = text;
  return client_->planning(request).value;
}

bool ExperimentRunner::collect(double seconds, const std::function<bool(RunMessages&)>& take) {
  return client_->waitFor(client_->timeout(seconds), [&](const client::Snapshot&) {
    const std::lock_guard lock(mutex_);
    return take(messages_);
  });
}

void ExperimentRunner::failWithoutProgress(double seconds, const std::string& reached) const {
  safety::FaultMask faults = 0;
  for (const auto mask : client_->snapshot().status.faults)
    faults |= mask;
  throw Failure(kFailure,
                fmt::format("no progress for {:.0f} s {}{}{}", client_->timeout(seconds), reached, client_->silent(),
                            faults != 0 ? ": " + safety::describeFaults(faults) : "; see `tandem status`"));
}

}  // namespace tandem::cli
