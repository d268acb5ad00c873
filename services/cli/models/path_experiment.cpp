// SPDX-License-Identifier: Apache-2.0
#include "services/cli/models/path_experiment.h"

#include <algorithm>
#include <fstream>
#include <optional>
#include <utility>

#include "config/path.h"
#include "operation/convert.h"
#include "planning/follower.h"
#include "planning/path_reference.h"
#include "services/cli/deployment/domain.h"
#include "services/runtime/process.h"

namespace tandem::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kPathProgress = 10.0;  // s without any: something is wrong

/** One period of a run: reference of planning, measured joints, solution of control. */
struct Period {
  dds::PlanningReference reference;
  dds::ActuationState state;
  dds::ControlStatus status;
};

/// The next reference of a run with its state and solution; none while they have not all arrived.
std::optional<Period> take(RunMessages& messages, std::uint32_t id) {
  auto& references = messages.references;
  while (!references.empty() && references.front().trajectory_id != id)
    references.pop_front();
  if (references.empty())
    return std::nullopt;
  const dds::PlanningReference& reference = references.front();
  const auto state = messages.states.find(reference.answers_state);
  const auto status = messages.statuses.find(reference.answers_state);
  const bool over = static_cast<planning::Phase>(reference.phase) != planning::Phase::kRunning;
  if (state == messages.states.end() || (!over && status == messages.statuses.end()))
    return std::nullopt;
  const Period period{reference, state->second, over ? dds::ControlStatus{} : status->second};
  references.pop_front();
  messages.states.erase(messages.states.begin(), state);
  return period;
}

Period next(ExperimentRunner& runner, std::uint32_t id, std::size_t periods) {
  std::optional<Period> found;
  if (!runner.collect(kPathProgress, [&](RunMessages& messages) { return (found = take(messages, id)).has_value(); }))
    runner.failWithoutProgress(kPathProgress, "after period " + std::to_string(periods));
  return *found;
}

/// Starts the path. @return its id; 0: refused, with the reason in `refused`
std::uint32_t start(ExperimentRunner& runner, const planning::ObjectPath& path, std::string& refused) {
  client::Client& client = runner.client();
  client.stateCommand("enable");
  const std::uint64_t enabled = client.snapshot().status.sequence;
  if (!client.waitFor(client.timeout(kPathProgress),
                      [&](const client::Snapshot& s) { return s.reference.answers_control >= enabled; }))
    throw Failure(kFailure,
                  "planning does not receive control/status; check that `tandem-control` and `tandem-planning` run "
                  "with the same deployment");
  try {
    return runner.start(config::formatPath(path));
  } catch (const client::Refusal& refusal) {
    refused = refusal.reason();
    return 0;
  }
}

safety::RobotVector jointsOf(const dds::ActuationState& state, int count) {
  safety::RobotVector q;
  if (!dds::measuredJoints(state, state.arm_count, count, q))
    throw Failure(kFailure, "found an actuation/state without valid joints of all arms, expected " +
                                std::to_string(count) + " joints");
  return q;
}

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

robots::TrackRecord runPath(ExperimentRunner& runner,
                            robots::Mechanism& mechanism,
                            const planning::ObjectPath& path,
                            const robots::TrackOptions& options,
                            const std::function<void(double, double)>& progress) {
  const double period = options.parameters.period;
  robots::TrackRecord record;
  for (const auto& [name, value] : mechanism.columns())
    record.names.push_back(name);
  const std::uint32_t id = start(runner, path, record.refused);
  if (!record.refused.empty())
    return record;
  const auto count = static_cast<int>(mechanism.home().size());
  std::uint32_t last = 0;
  bool shaped = false;
  planning::Phase phase = planning::Phase::kRunning;
  while (phase == planning::Phase::kRunning) {
    const Period now = next(runner, id, record.steps.size());
    phase = static_cast<planning::Phase>(now.reference.phase);
    const safety::RobotVector q = jointsOf(now.state, count);
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
    const auto before = static_cast<double>(record.steps.size()) * period;
    const double time = along ? (last - 1) * period : before - options.preparation_time;
    robots::TrackStep step = robots::noteStep(mechanism, q, time);
    step.error = planning::trackedError(path, step.pose, planning::poseOf(dds::tasksOf(now.reference).object));
    step.active_limits = static_cast<int>(now.status.active_limits);
    step.status = static_cast<control::SolveStatus>(now.status.solve_status);
    record.steps.push_back(std::move(step));
    if (progress)
      progress(std::max(0.0, time), path.duration);
  }
  if (phase != planning::Phase::kFinished) {
    runner.client().waitFor(1.0, [id](const client::Snapshot& s) { return s.summary.trajectory_id == id; });
    const client::Snapshot now = runner.client().snapshot();
    const std::string why = now.summary.trajectory_id == id ? now.summary.reason : "";
    (last == 0 ? record.refused : record.stopped) = why.empty() ? "planning ended the run" : why;
  }
  if (record.refused.empty())
    robots::judge(options, record);
  return record;
}

}  // namespace tandem::cli
