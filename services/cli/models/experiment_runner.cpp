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
#include "services/cli/subcommand.h"
#include "services/client/motions.h"
#include "services/runtime/joint_text.h"

namespace tandem::cli {
namespace {

/** A run that cannot be continued; the next one can. */
class RunEnded : public Failure {
 public:
  explicit RunEnded(const std::string& why) : Failure(kFailure, why) {}
};

constexpr double kProgress = 5.0;  // s without any: something is wrong

}  // namespace

ExperimentRunner::ExperimentRunner(const config::Deployment& deployment,
                                   const config::Robot& robot,
                                   const robots::RobotModel& model,
                                   std::function<bool()> interrupted)
    : model_(model), lock_step_(deployment.clock == config::ClockMode::kLockStep), arm_names_(config::armList(robot)) {
  if (static_cast<int>(robot.arms.size()) != model.armCount())
    throw Failure(kUsage, "robot: found " + std::to_string(robot.arms.size()) + " arms, expected the " +
                              std::to_string(model.armCount()) + " of its model");
  client::Client::Callbacks callbacks;
  callbacks.state = [this](const dds::ActuationState& m) {
    const std::lock_guard lock(mutex_);
    states_[m.sequence] = m;
    constexpr std::size_t kMostStates = 4096;  // real time has no end
    if (!lock_step_ && states_.size() > kMostStates)
      states_.erase(states_.begin());
  };
  callbacks.status = [this](const dds::ControlStatus& m) {
    const std::lock_guard lock(mutex_);
    if (m.task_count > 0)
      statuses_[lock_step_ ? m.answers_state : m.answers_reference] = m;
  };
  callbacks.reference = [this](const dds::PlanningReference& m) {
    const std::lock_guard lock(mutex_);
    references_.push_back(m);
  };
  if (lock_step_) {
    callbacks.sim_tips = [this](const dds::TipPoses& m) {
      const std::lock_guard lock(mutex_);
      tips_[m.answers_state] = m;
    };
  }
  callbacks.hal = [this](const dds::HalStatus& m) {
    const std::lock_guard lock(mutex_);
    gate_actions_[m.sequence] = std::accumulate(m.guard_count.begin(), m.guard_count.end(), std::uint64_t{0});
  };
  client_ = std::make_unique<client::Client>(deployment, callbacks);
  client::takeCommand(*client_, std::move(interrupted));
}

ExperimentRunner::~ExperimentRunner() { client::endCommand(*client_); }

safety::RobotVector ExperimentRunner::stacked(const dds::JointArray& joints) const {
  safety::RobotVector q(model_.jointCount());
  for (int k = 0; k < model_.armCount(); ++k)
    q.segment(model_.offset(k), model_.size(k)) = dds::jointsOf(joints, k, model_.size(k));
  return q;
}

void ExperimentRunner::refuseFault(const client::Snapshot& s, const std::string& when) const {
  for (std::size_t k = 0; k < arm_names_.size(); ++k) {
    const safety::FaultMask faults = s.status.faults[k] | s.state.faults[k];
    if (faults != 0)
      throw RunEnded((when.empty() ? "" : when + ": ") + arm_names_[k] +
                     " is in FAULT: " + safety::describeFaults(faults));
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
  const std::uint32_t joint_resets = client_->snapshot().state.joint_resets;
  client_->sim(reset);
  client_->setMethod(plan.key.method);
  client_->stateCommand("enable");
  return joint_resets;
}

void ExperimentRunner::moveToStart(const experiments::RunPlan& plan) {
  constexpr double kBoot = 20.0, kJourney = 600.0;  // s
  const auto valid = [](const client::Snapshot& s) {
    return std::all_of(s.state.valid.begin(), s.state.valid.begin() + s.state.arm_count, [](int v) { return v == 1; });
  };
  const auto faulty = [](const client::Snapshot& s) {
    return std::any_of(s.state.faults.begin(), s.state.faults.begin() + s.state.arm_count,
                       [](auto f) { return f != 0; });
  };
  // What does not come up while everything starts at once gets a second boot.
  client_->waitFor(kBoot, [&](const client::Snapshot& s) { return s.states > 0 && (valid(s) || faulty(s)); });
  if (faulty(client_->snapshot()))
    client_->stateCommand("disable");
  if (!client_->waitFor(kBoot, valid))
    throw Failure(kFailure, "the drives are not homed; see `tandem can monitor`, run `tandem home`");
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
  const bool there = client_->waitFor(kJourney, [&](const client::Snapshot& s) {
    bool busy = s.status.sequence <= asked, latched = false;
    for (std::size_t k = 0; k < s.status.arm_count; ++k) {
      busy = busy || s.status.busy[k] != 0;
      latched = latched || s.status.faults[k] != 0;
    }
    return latched || !busy;
  });
  refuseFault(client_->snapshot(), "on the way to the start");
  if (!there)
    throw Failure(kFailure, plan.key.name() + ": the arms did not reach the start");
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
  const client::Snapshot enabled = client_->snapshot();
  const bool ready = client_->waitFor(client_->timeout(kProgress), [&](const client::Snapshot& s) {
    const bool there = lock_step_
                           ? s.state.joint_resets != joint_resets && s.reference.answers_state == s.state.sequence
                           : (positions(s.state) - wanted).cwiseAbs().maxCoeff() < safety::kPositionTolerance;
    return there && s.reference.answers_control >= enabled.status.sequence;
  });
  if (ready)
    return;
  Eigen::Index joint = 0;
  const double error = (positions(client_->snapshot().state) - wanted).cwiseAbs().maxCoeff(&joint);
  int arm = model_.armCount() - 1;
  while (arm > 0 && joint < model_.offset(arm))
    --arm;
  const int own = static_cast<int>(joint) - model_.offset(arm);
  const bool translation = model_.limits()[static_cast<std::size_t>(arm)]->isTranslation(own);
  throw Failure(kFailure, plan.key.name() + ": start configuration not reached; largest joint error " +
                              runtime::jointText(error, translation, "{:.3g}"));
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

experiments::StepData dataOf(const dds::PlanningReference& reference) {
  experiments::StepData data;
  data.point = static_cast<int>(reference.point);
  data.iteration = static_cast<int>(reference.iteration);
  data.reference = dds::tasksOf(reference);
  return data;
}

void addSolution(const dds::ControlStatus& status, experiments::StepData& data) {
  data.scale = status.task_scale;
  data.solver_iterations = status.iterations;
  data.active_limits = status.active_limits;
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
  experiments::StepData data = dataOf(reference);
  data.position = positions(state->second);
  data.setpoint = stacked(state->second.setpoint);
  for (int k = 0; k < model_.armCount(); ++k) {
    if (tips->second.valid[static_cast<std::size_t>(k)] == 0)
      throw RunEnded(arm_names_[static_cast<std::size_t>(k)] +
                     ": the simulated arm has no equilibrium at these joints");
    data.tip[static_cast<std::size_t>(k)] = dds::tipPosition(tips->second, k);
    data.orientation[static_cast<std::size_t>(k)] = dds::tipOrientation(tips->second, k);
  }
  addSolution(status->second, data);
  data.gate_actions = actions_after->second - actions_before->second;
  record.add(data);
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

/// True tips of hardware are unknown; adds the tips of the model at the measured joints.
void ExperimentRunner::addModelTips(experiments::StepData& data) {
  for (int k = 0; k < model_.armCount(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    kinematics::Tip tip;
    const auto status =
        model_.models()[i]->tip(data.position.segment(model_.offset(k), model_.size(k)), branches_[i], tip);
    if (status != kinematics::ModelStatus::kOk)
      throw RunEnded(arm_names_[i] + ": " + std::string(kinematics::describe(status)));
    data.tip[i] = tip.pose.translation();
    data.orientation[i] = tip.pose.linear();
  }
}

/// The iteration that is open is over: planning has judged it by this state.
bool ExperimentRunner::closeIteration(experiments::RunRecord& record, std::uint64_t judged_by) {
  const auto state = states_.lower_bound(judged_by);
  if (state == states_.end())
    return false;
  experiments::StepData data = dataOf(*open_);
  data.position = positions(state->second);
  data.setpoint = stacked(state->second.setpoint);
  addModelTips(data);
  // The status that answered it, or the one before: a lost sample costs two figures of a row, no row.
  auto status = statuses_.upper_bound(open_->sequence);
  if (status != statuses_.begin())
    addSolution(std::prev(status)->second, data);
  // Guards are published less often than states: the last word before this state counts.
  auto actions = gate_actions_.upper_bound(judged_by);
  const std::uint64_t now = actions == gate_actions_.begin() ? gate_actions_before_ : std::prev(actions)->second;
  data.gate_actions = now - std::min(now, gate_actions_before_);
  gate_actions_before_ = std::max(now, gate_actions_before_);
  record.add(data);
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
  experiments::RunRecord record(plan.key, model_, plan.trajectory.point_count, plan.trajectory.tolerance);
  try {
    follow(plan, progress, record);
  } catch (const RunEnded& ended) {
    record.fail(ended.what());
  }
  return record;
}

void ExperimentRunner::follow(const experiments::RunPlan& plan,
                              const std::function<void(int, int)>& progress,
                              experiments::RunRecord& record) {
  prepare(plan);
  forget();
  dds::PlanningRequest request;
  request.kind = static_cast<std::uint8_t>(dds::PlanningKind::kStart);
  request.trajectory = config::formatTrajectory(plan.trajectory);
  const std::uint32_t id = client_->planning(request).value;
  for (bool ended = false; !ended;) {
    const bool progressed = client_->waitFor(client_->timeout(kProgress), [&](const client::Snapshot&) {
      const std::lock_guard lock(mutex_);
      return lock_step_ ? collectLockStep(record, id, ended) : collectRealTime(record, id, ended);
    });
    if (!ended)
      refuseFault(client_->snapshot(), "");
    if (!progressed) {
      throw Failure(kFailure, fmt::format("{}: no progress for {:.0f} s after iteration {}{}", plan.key.name(),
                                          client_->timeout(kProgress), record.rows().size(), client_->silent()));
    }
    if (progress && !record.rows().empty())
      progress(record.rows().back().data.point, plan.trajectory.point_count);
  }
  refuseFault(client_->snapshot(), "");
}

}  // namespace tandem::cli
