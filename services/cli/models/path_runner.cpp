// SPDX-License-Identifier: Apache-2.0
#include "services/cli/models/path_runner.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <utility>

#include "config/path.h"
#include "operation/convert.h"
#include "planning/follower.h"
#include "planning/path_reference.h"
#include "safety/faults.h"
#include "services/cli/deployment/domain.h"
#include "services/cli/subcommand.h"
#include "services/client/motions.h"
#include "services/runtime/process.h"

namespace tandem::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kPathProgress = 10.0;  // s without any: something is wrong

}  // namespace

TemporaryDeployment::TemporaryDeployment(const fs::path& robot, double period, double gain, control::Method method) {
  const fs::path file = folder_.path() / "deployment.yaml";
  char numbers[128];
  std::snprintf(numbers, sizeof numbers, "control_period_s: %.17g\nrelative_gain_per_s: %.17g\ntip_gain_per_s: %.17g\n",
                period, gain, gain);
  std::ofstream(file) << "tandem: deployment/1\nname: lockstep\nrobot: \"" << fs::absolute(robot).string()
                      << "\"\nclock: lock_step\nmethod: " << control::name(method) << '\n'
                      << numbers
                      << "processes:\n  - {name: sim, executable: tandem-sim}\n"
                         "  - {name: control, executable: tandem-control}\n"
                         "  - {name: planning, executable: tandem-planning}\n";
  deployment_ = runtime::loadDeployment(file);
  useOwnDomain(deployment_);
}

PathRunner::PathRunner(const config::Deployment& deployment, std::function<bool()> interrupted)
    : period_(deployment.control_period) {
  client::Client::Callbacks callbacks;
  callbacks.state = [this](const dds::ActuationState& m) {
    const std::lock_guard lock(mutex_);
    states_[m.sequence] = m;
  };
  callbacks.status = [this](const dds::ControlStatus& m) {
    const std::lock_guard lock(mutex_);
    if (m.task_count > 0)
      statuses_[m.answers_state] = m;
  };
  callbacks.reference = [this](const dds::PlanningReference& m) {
    const std::lock_guard lock(mutex_);
    references_.push_back(m);
  };
  client_ = std::make_unique<client::Client>(deployment, callbacks);
  client::takeCommand(*client_, std::move(interrupted));
}

PathRunner::~PathRunner() { client::endCommand(*client_); }

std::uint32_t PathRunner::start(const planning::ObjectPath& path, std::string& refused) {
  client_->stateCommand("enable");
  const std::uint64_t enabled = client_->snapshot().status.sequence;
  if (!client_->waitFor(client_->timeout(kPathProgress),
                        [&](const client::Snapshot& s) { return s.reference.answers_control >= enabled; }))
    throw Failure(kFailure,
                  "planning does not receive control/status; check that `tandem-control` and `tandem-planning` run "
                  "with the same deployment");
  dds::PlanningRequest request;
  request.kind = static_cast<std::uint8_t>(dds::PlanningKind::kStart);
  request.trajectory = config::formatPath(path);
  try {
    return client_->planning(request).value;
  } catch (const client::Refusal& refusal) {
    refused = refusal.reason();
    return 0;
  }
}

/// The next reference of the run with what goes with it, when all of it is here.
std::optional<PathRunner::Period> PathRunner::take(std::uint32_t id) {
  const std::lock_guard lock(mutex_);
  while (!references_.empty() && references_.front().trajectory_id != id)
    references_.pop_front();
  if (references_.empty())
    return std::nullopt;
  const dds::PlanningReference& reference = references_.front();
  const auto state = states_.find(reference.answers_state);
  const auto status = statuses_.find(reference.answers_state);
  const bool over = static_cast<planning::Phase>(reference.phase) != planning::Phase::kRunning;
  if (state == states_.end() || (!over && status == statuses_.end()))
    return std::nullopt;
  const Period period{reference, state->second, over ? dds::ControlStatus{} : status->second};
  references_.pop_front();
  states_.erase(states_.begin(), state);
  return period;
}

PathRunner::Period PathRunner::next(std::uint32_t id, std::size_t periods) {
  std::optional<Period> found;
  client_->waitFor(client_->timeout(kPathProgress),
                   [&](const client::Snapshot&) { return (found = take(id)).has_value(); });
  if (found)
    return *found;
  const safety::FaultMask faults = client_->snapshot().status.faults[0];
  throw Failure(kFailure, "no progress for " + std::to_string(std::lround(client_->timeout(kPathProgress))) +
                              " s after period " + std::to_string(periods) + client_->silent() +
                              (faults != 0 ? ": " + safety::describeFaults(faults) : ""));
}

safety::RobotVector PathRunner::joints(const dds::ActuationState& state, int count) const {
  safety::RobotVector q;
  if (!dds::measuredJoints(state, state.arm_count, count, q))
    throw Failure(kFailure, "found an actuation/state without valid joints of all arms, expected " +
                                std::to_string(count) + " joints");
  return q;
}

robots::TrackRecord PathRunner::run(robots::Mechanism& mechanism,
                                    const planning::ObjectPath& path,
                                    const robots::TrackOptions& options,
                                    const std::function<void(double, double)>& progress) {
  robots::TrackRecord record;
  for (const auto& [name, value] : mechanism.columns())
    record.names.push_back(name);
  const std::uint32_t id = start(path, record.refused);
  if (!record.refused.empty())
    return record;
  const auto count = static_cast<int>(mechanism.home().size());
  std::uint32_t last = 0;
  bool shaped = false;
  planning::Phase phase = planning::Phase::kRunning;
  while (phase == planning::Phase::kRunning) {
    const Period now = next(id, record.steps.size());
    phase = static_cast<planning::Phase>(now.reference.phase);
    const safety::RobotVector q = joints(now.state, count);
    if (const std::string why = mechanism.solveEquilibrium(q); !why.empty())
      throw Failure(kFailure, "no equilibrium at the joints of period " + std::to_string(record.steps.size()) + ": " +
                                  why + "; move the start or the path away from these joints");
    const bool along = now.reference.iteration > 0;
    if (along && record.first_shape.empty())
      record.first_shape = mechanism.shapes();
    // Held at its end the path is over: what counts of it has been noted.
    if (phase != planning::Phase::kRunning || (along && now.reference.iteration == last)) {
      if (along && !std::exchange(shaped, true))
        record.last_shape = mechanism.shapes();
      continue;
    }
    last = now.reference.iteration;
    const auto before = static_cast<double>(record.steps.size()) * period_;
    const double time = along ? (last - 1) * period_ : before - options.preparation_time;
    robots::TrackStep step = robots::noteStep(mechanism, q, time);
    step.error = planning::trackedError(path, step.pose, planning::poseOf(dds::tasksOf(now.reference).object));
    step.active_limits = static_cast<int>(now.status.active_limits);
    step.status = static_cast<control::SolveStatus>(now.status.solve_status);
    record.steps.push_back(std::move(step));
    if (progress)
      progress(std::max(0.0, time), path.duration);
  }
  if (phase != planning::Phase::kFinished) {
    client_->waitFor(1.0, [id](const client::Snapshot& s) { return s.summary.trajectory_id == id; });
    const client::Snapshot now = client_->snapshot();
    const std::string why = now.summary.trajectory_id == id ? now.summary.reason : "";
    (last == 0 ? record.refused : record.stopped) = why.empty() ? "planning ended the run" : why;
  }
  if (record.refused.empty())
    robots::judge(options, record);
  return record;
}

}  // namespace tandem::cli
