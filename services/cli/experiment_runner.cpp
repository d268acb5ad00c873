// SPDX-License-Identifier: Apache-2.0
#include "services/cli/experiment_runner.h"

#include <numeric>

#include "planning/follower.h"
#include "services/cli/arguments.h"
#include "services/dds/convert.h"

namespace tandem::cli {
namespace {

constexpr double kSilence = 5.0;  // s without progress: something is wrong

}  // namespace

ExperimentRunner::ExperimentRunner(const config::Deployment& deployment,
                                   const config::Robot& robot,
                                   const experiments::RobotModel& model,
                                   std::function<bool()> interrupted)
    : model_(model) {
  if (deployment.clock != config::ClockMode::kLockStep) {
    throw Failure(kUsage, deployment.file.string() + ": experiments need `clock: lock_step`");
  }
  if (static_cast<int>(robot.arms.size()) != model.armCount())
    throw Failure(kUsage, "robot and model differ");
  Client::Taps taps;
  taps.state = [this](const dds::ActuationState& m) {
    const std::lock_guard lock(mutex_);
    states_[m.sequence] = m;
  };
  taps.status = [this](const dds::ControlStatus& m) {
    const std::lock_guard lock(mutex_);
    if (m.task_count > 0)
      statuses_[m.answers_state] = m;
  };
  taps.reference = [this](const dds::PlanningReference& m) {
    const std::lock_guard lock(mutex_);
    references_.push_back(m);
  };
  taps.sim_tips = [this](const dds::TipPoses& m) {
    const std::lock_guard lock(mutex_);
    tips_[m.answers_state] = m;
  };
  taps.hal = [this](const dds::HalStatus& m) {
    const std::lock_guard lock(mutex_);
    gate_actions_[m.sequence] = std::accumulate(m.guard_count.begin(), m.guard_count.end(), std::uint64_t{0});
  };
  client_ = std::make_unique<Client>(deployment, taps);
  client_->interruptBy(std::move(interrupted));
  client_->connect(20.0);
  client_->acquireLease();
}

ExperimentRunner::~ExperimentRunner() {
  try {
    client_->stateCommand("disable");
    client_->releaseLease();
  } catch (const std::exception&) {
    // The system is going down with us or before us; there is nobody to tell.
  }
}

safety::RobotVector ExperimentRunner::positions(const dds::ActuationState& state) const {
  safety::RobotVector q(model_.jointCount());
  for (int k = 0; k < model_.armCount(); ++k) {
    for (int j = 0; j < model_.size(k); ++j) {
      q[model_.offset(k) + j] = state.position[dds::jointIndex(k, j)];
    }
  }
  return q;
}

void ExperimentRunner::prepare(const experiments::RunPlan& plan) {
  client_->stateCommand("disable");
  dds::SimRequest reset;
  reset.kind = 1;
  reset.arm_count = static_cast<std::uint8_t>(model_.armCount());
  for (int k = 0; k < model_.armCount(); ++k) {
    for (int j = 0; j < model_.size(k); ++j) {
      reset.joints[dds::jointIndex(k, j)] = plan.start[static_cast<std::size_t>(k)][j];
    }
  }
  const std::uint32_t placements = client_->snapshot().state.placements;
  client_->sim(reset);
  client_->setMethod(plan.key.method);
  client_->stateCommand("enable");
  // Planning must have seen the robot at the start, and enabled, before it lays the trajectory from there.
  const Snapshot enabled = client_->snapshot();
  const bool ready = client_->waitFor(kSilence, [&](const Snapshot& s) {
    return s.state.placements != placements && s.reference.answers_state == s.state.sequence &&
           s.reference.answers_control >= enabled.status.sequence;
  });
  if (!ready)
    throw Failure(kFailure, plan.key.name() + ": the robot did not get to its start configuration");
}

void ExperimentRunner::forget() {
  const std::lock_guard lock(mutex_);
  references_.clear();
  states_.clear();
  tips_.clear();
  statuses_.clear();
  // The counters at the start of the run are the last ones so far.
  while (gate_actions_.size() > 1)
    gate_actions_.erase(gate_actions_.begin());
}

bool ExperimentRunner::addRow(experiments::RunRecord& record, const dds::PlanningReference& reference) {
  const std::uint64_t before = reference.answers_state, after = before + 1;
  const auto state = states_.find(after);
  const auto status = statuses_.find(before);
  const auto tips = tips_.find(after);
  const auto actions_before = gate_actions_.find(before), actions_after = gate_actions_.find(after);
  if (state == states_.end() || tips == tips_.end() || status == statuses_.end() ||
      actions_before == gate_actions_.end() || actions_after == gate_actions_.end()) {
    return false;
  }
  experiments::StepFacts facts;
  facts.point = static_cast<int>(reference.point);
  facts.iteration = static_cast<int>(reference.iteration);
  facts.reference = dds::tasksOf(reference);
  facts.position = positions(state->second);
  for (int k = 0; k < model_.armCount(); ++k) {
    if (tips->second.valid[static_cast<std::size_t>(k)] == 0)
      throw Failure(kFailure, "the plant has no equilibrium for these joints");
    facts.tip[static_cast<std::size_t>(k)] = dds::tipPosition(tips->second, k);
  }
  facts.scale = {status->second.task_scale[0], status->second.task_scale[1]};
  facts.solver_iterations = status->second.iterations;
  facts.active_limits = status->second.active_limits;
  facts.gate_actions = actions_after->second - actions_before->second;
  record.add(facts);
  return true;
}

experiments::RunRecord ExperimentRunner::run(const experiments::RunPlan& plan,
                                             const std::function<void(int, int)>& progress) {
  prepare(plan);
  forget();
  dds::PlanningRequest request;
  request.kind = 1;
  request.trajectory = config::formatTrajectory(plan.trajectory);
  const std::uint32_t id = client_->planning(request).value;
  experiments::RunRecord record(plan.key, model_, plan.trajectory.point_count, plan.trajectory.tolerance);
  for (bool ended = false; !ended;) {
    // A row is complete when the reference, its status, and the state and guard counters behind it have all arrived.
    const bool progressed = client_->waitFor(kSilence, [&](const Snapshot&) {
      const std::lock_guard lock(mutex_);
      bool any = false;
      while (!references_.empty()) {
        const dds::PlanningReference& next = references_.front();
        const auto phase = static_cast<planning::Phase>(next.phase);
        const bool ours = next.trajectory_id == id;
        ended = ours && phase != planning::Phase::kRunning && phase != planning::Phase::kPaused;
        if (ended)
          return true;
        if (ours && !addRow(record, next))
          return any;
        references_.pop_front();
        any = true;
      }
      return any;
    });
    if (!progressed) {
      throw Failure(kFailure,
                    plan.key.name() + ": no progress for 5 s after iteration " + std::to_string(record.rows().size()));
    }
    if (progress && !record.rows().empty())
      progress(record.rows().back().facts.point, plan.trajectory.point_count);
  }
  return record;
}

}  // namespace tandem::cli
