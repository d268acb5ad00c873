// SPDX-License-Identifier: Apache-2.0
#include "services/cli/models/experiment_runner.h"
#include "config/arm_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "operation/convert.h"
#include "planning/follower.h"
#include "safety/faults.h"
#include "safety/joint_motion.h"
#include "services/client/arguments.h"
#include "services/client/motions.h"

namespace tandem::cli {
namespace {

constexpr double kProgress = 5.0;  // s without any: something is wrong

}  // namespace

ExperimentRunner::ExperimentRunner(const config::Deployment& deployment,
                                   const config::Robot& robot,
                                   const robots::RobotModel& model,
                                   std::function<bool()> interrupted)
    : model_(model), lock_step_(deployment.clock == config::ClockMode::kLockStep), arm_names_(config::armList(robot)) {
  if (static_cast<int>(robot.arms.size()) != model.armCount())
    throw Failure(kUsage, "robot and model differ");
  Client::Taps taps;
  taps.state = [this](const dds::ActuationState& m) {
    const std::lock_guard lock(mutex_);
    states_[m.sequence] = m;
    constexpr std::size_t kMostStates = 4096;  // real time has no end
    if (!lock_step_ && states_.size() > kMostStates)
      states_.erase(states_.begin());
  };
  taps.status = [this](const dds::ControlStatus& m) {
    const std::lock_guard lock(mutex_);
    if (m.task_count > 0)
      statuses_[lock_step_ ? m.answers_state : m.answers_reference] = m;
  };
  taps.reference = [this](const dds::PlanningReference& m) {
    const std::lock_guard lock(mutex_);
    references_.push_back(m);
  };
  if (lock_step_) {
    taps.sim_tips = [this](const dds::TipPoses& m) {
      const std::lock_guard lock(mutex_);
      tips_[m.answers_state] = m;
    };
  }
  taps.hal = [this](const dds::HalStatus& m) {
    const std::lock_guard lock(mutex_);
    gate_actions_[m.sequence] = std::accumulate(m.guard_count.begin(), m.guard_count.end(), std::uint64_t{0});
  };
  client_ = std::make_unique<Client>(deployment, taps);
  takeCommand(*client_, std::move(interrupted));
}

ExperimentRunner::~ExperimentRunner() { leaveCommand(*client_); }

safety::RobotVector ExperimentRunner::stacked(const dds::JointArray& joints) const {
  safety::RobotVector q(model_.jointCount());
  for (int k = 0; k < model_.armCount(); ++k)
    q.segment(model_.offset(k), model_.size(k)) = dds::jointsOf(joints, k, model_.size(k));
  return q;
}

void ExperimentRunner::refuseFault(const Snapshot& s, const std::string& when) const {
  for (std::size_t k = 0; k < arm_names_.size(); ++k) {
    const safety::FaultMask faults = s.status.faults[k] | s.state.faults[k];
    if (faults != 0)
      throw Failure(kFailure, when + ": " + arm_names_[k] + " is in FAULT: " + safety::describeFaults(faults));
  }
}

std::uint32_t ExperimentRunner::placeAtStart(const experiments::RunPlan& plan) {
  client_->stateCommand("disable");
  dds::SimRequest reset;
  reset.kind = static_cast<std::uint8_t>(dds::SimKind::kReset);
  reset.arm_count = static_cast<std::uint8_t>(model_.armCount());
  for (int k = 0; k < model_.armCount(); ++k) {
    for (int j = 0; j < model_.size(k); ++j) {
      reset.joints[dds::jointIndex(k, j)] = plan.start[static_cast<std::size_t>(k)][j];
    }
  }
  const std::uint32_t joint_resets = client_->snapshot().state.placements;
  client_->sim(reset);
  client_->setMethod(plan.key.method);
  client_->stateCommand("enable");
  return joint_resets;
}

void ExperimentRunner::moveToStart(const experiments::RunPlan& plan) {
  constexpr double kBoot = 20.0, kJourney = 600.0;  // s
  const auto valid = [](const Snapshot& s) {
    return std::all_of(s.state.valid.begin(), s.state.valid.begin() + s.state.arm_count, [](int v) { return v == 1; });
  };
  const auto faulty = [](const Snapshot& s) {
    return std::any_of(s.state.faults.begin(), s.state.faults.begin() + s.state.arm_count,
                       [](auto f) { return f != 0; });
  };
  // What does not come up while everything starts at once gets a second boot.
  client_->waitFor(kBoot, [&](const Snapshot& s) { return s.states > 0 && (valid(s) || faulty(s)); });
  if (faulty(client_->snapshot()))
    client_->stateCommand("disable");
  if (!client_->waitFor(kBoot, valid))
    throw Failure(kFailure, "the joints do not say where they are; tandem can monitor, tandem home");
  client_->stateCommand("disable");
  client_->setMethod(plan.key.method);
  client_->stateCommand("enable");
  std::uint64_t asked = 0;
  for (int k = 0; k < model_.armCount(); ++k) {
    dds::ControlRequest move;
    move.kind = static_cast<std::uint8_t>(dds::ControlKind::kMoveJp);
    move.arm = static_cast<std::uint8_t>(k);
    move.joint_count = static_cast<std::uint8_t>(model_.size(k));
    for (int j = 0; j < model_.size(k); ++j)
      move.joints[static_cast<std::size_t>(j)] = plan.start[static_cast<std::size_t>(k)][j];
    asked = client_->control(move).value;
  }
  const bool there = client_->waitFor(kJourney, [&](const Snapshot& s) {
    bool busy = s.status.sequence <= asked, latched = false;
    for (std::size_t k = 0; k < s.status.arm_count; ++k) {
      busy = busy || s.status.busy[k] != 0;
      latched = latched || s.status.faults[k] != 0;
    }
    return latched || !busy;
  });
  refuseFault(client_->snapshot(), plan.key.name() + ", on the way to the start");
  if (!there)
    throw Failure(kFailure, plan.key.name() + ": the arms did not arrive at the start");
}

void ExperimentRunner::prepare(const experiments::RunPlan& plan) {
  std::uint32_t joint_resets = 0;
  if (lock_step_) {
    joint_resets = placeAtStart(plan);
  } else {
    moveToStart(plan);
  }
  // Planning must have seen the robot at the start, and enabled, before it lays the trajectory from there.
  const safety::RobotVector wanted = model_.stack(plan.start);
  const Snapshot enabled = client_->snapshot();
  const bool ready = client_->waitFor(client_->patience(kProgress), [&](const Snapshot& s) {
    const bool there = lock_step_ ? s.state.placements != joint_resets && s.reference.answers_state == s.state.sequence
                                  : (positions(s.state) - wanted).cwiseAbs().maxCoeff() < safety::kAtRest;
    return there && s.reference.answers_control >= enabled.status.sequence;
  });
  if (!ready)
    throw Failure(kFailure,
                  fmt::format("{}: the robot did not get to its start configuration; the joints are up to {:.3g} "
                              "(m or rad) away",
                              plan.key.name(), (positions(client_->snapshot().state) - wanted).cwiseAbs().maxCoeff()));
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
  gate_actions_before_ = gate_actions_.empty() ? 0 : gate_actions_.begin()->second;
  branches_.assign(static_cast<std::size_t>(model_.armCount()), {});
  open_.reset();
}

namespace {

experiments::StepFacts factsOf(const dds::PlanningReference& reference) {
  experiments::StepFacts facts;
  facts.point = static_cast<int>(reference.point);
  facts.iteration = static_cast<int>(reference.iteration);
  facts.reference = dds::tasksOf(reference);
  return facts;
}

void addSolution(const dds::ControlStatus& status, experiments::StepFacts& facts) {
  facts.scale = {status.task_scale[0], status.task_scale[1]};
  facts.solver_iterations = status.iterations;
  facts.active_limits = status.active_limits;
}

bool goesOn(const dds::PlanningReference& reference) {
  const auto phase = static_cast<planning::Phase>(reference.phase);
  return phase == planning::Phase::kRunning || phase == planning::Phase::kPaused;
}

}  // namespace

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
  experiments::StepFacts facts = factsOf(reference);
  facts.position = positions(state->second);
  for (int k = 0; k < model_.armCount(); ++k) {
    if (tips->second.valid[static_cast<std::size_t>(k)] == 0)
      throw Failure(kFailure, "the plant has no equilibrium for these joints");
    facts.tip[static_cast<std::size_t>(k)] = dds::tipPosition(tips->second, k);
  }
  addSolution(status->second, facts);
  facts.gate_actions = actions_after->second - actions_before->second;
  record.add(facts);
  return true;
}

/// A row is complete when the reference, its status, and the state and guard counters behind it have all arrived.
bool ExperimentRunner::collectLockStep(experiments::RunRecord& record, std::uint32_t id, bool& ended) {
  bool any = false;
  for (; !references_.empty(); references_.pop_front(), any = true) {
    const dds::PlanningReference& next = references_.front();
    const bool ours = next.trajectory_id == id;
    ended = ours && !goesOn(next);
    if (ended)
      return true;
    if (ours && !addRow(record, next))
      return any;
  }
  return any;
}

/// Where the tips of hardware really are, nobody tells: those of the model for the joints as measured.
void ExperimentRunner::addModelTips(experiments::StepFacts& facts) {
  for (int k = 0; k < model_.armCount(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    kinematics::Tip tip;
    const auto status =
        model_.models()[i]->tip(facts.position.segment(model_.offset(k), model_.size(k)), branches_[i], tip);
    if (status != kinematics::ModelStatus::kOk)
      throw Failure(kFailure, arm_names_[i] + ": " + std::string(kinematics::describe(status)));
    facts.tip[i] = tip.pose.translation();
  }
}

/// The iteration that is open is over: planning has judged it by this state.
bool ExperimentRunner::closeIteration(experiments::RunRecord& record, std::uint64_t judged_by) {
  const auto state = states_.lower_bound(judged_by);
  if (state == states_.end())
    return false;
  experiments::StepFacts facts = factsOf(*open_);
  facts.position = positions(state->second);
  facts.setpoint = stacked(state->second.setpoint);
  addModelTips(facts);
  // The status that answered it, or the one before: a lost sample costs two figures of a row, no row.
  auto status = statuses_.upper_bound(open_->sequence);
  if (status != statuses_.begin())
    addSolution(std::prev(status)->second, facts);
  // Guards are published less often than states: the last word before this state counts.
  auto actions = gate_actions_.upper_bound(judged_by);
  const std::uint64_t now = actions == gate_actions_.begin() ? gate_actions_before_ : std::prev(actions)->second;
  facts.gate_actions = now - std::min(now, gate_actions_before_);
  gate_actions_before_ = std::max(now, gate_actions_before_);
  record.add(facts);
  states_.erase(states_.begin(), state);
  open_.reset();
  return true;
}

/// In real time a reference is repeated until control has answered it: an iteration is what has one number.
bool ExperimentRunner::collectRealTime(experiments::RunRecord& record, std::uint32_t id, bool& ended) {
  bool any = false;
  for (; !references_.empty(); references_.pop_front(), any = true) {
    const dds::PlanningReference& next = references_.front();
    if (next.trajectory_id != id || (goesOn(next) && next.task_count == 0))
      continue;
    const bool same = open_ && goesOn(next) && next.total_iterations == open_->total_iterations;
    if (same)
      continue;
    if (open_ && !closeIteration(record, next.answers_state))
      return any;
    ended = !goesOn(next);
    if (ended)
      return true;
    open_ = next;
  }
  return any;
}

experiments::RunRecord ExperimentRunner::run(const experiments::RunPlan& plan,
                                             const std::function<void(int, int)>& progress) {
  prepare(plan);
  forget();
  dds::PlanningRequest request;
  request.kind = static_cast<std::uint8_t>(dds::PlanningKind::kStart);
  request.trajectory = config::formatTrajectory(plan.trajectory);
  const std::uint32_t id = client_->planning(request).value;
  experiments::RunRecord record(plan.key, model_, plan.trajectory.point_count, plan.trajectory.tolerance);
  for (bool ended = false; !ended;) {
    const bool progressed = client_->waitFor(client_->patience(kProgress), [&](const Snapshot&) {
      const std::lock_guard lock(mutex_);
      return lock_step_ ? collectLockStep(record, id, ended) : collectRealTime(record, id, ended);
    });
    if (!ended)
      refuseFault(client_->snapshot(), plan.key.name());
    if (!progressed) {
      throw Failure(kFailure, fmt::format("{}: no progress for {:.0f} s after iteration {}{}", plan.key.name(),
                                          client_->patience(kProgress), record.rows().size(), client_->silent()));
    }
    if (progress && !record.rows().empty())
      progress(record.rows().back().facts.point, plan.trajectory.point_count);
  }
  refuseFault(client_->snapshot(), plan.key.name());
  return record;
}

}  // namespace tandem::cli
