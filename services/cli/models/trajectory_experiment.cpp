// SPDX-License-Identifier: Apache-2.0
#include "services/cli/models/trajectory_experiment.h"

#include <fmt/format.h>

#include <algorithm>

#include "config/arm_names.h"
#include "operation/convert.h"
#include "operation/permission.h"
#include "planning/follower.h"
#include "safety/faults.h"
#include "safety/joint_motion.h"
#include "services/runtime/joint_text.h"

namespace tandem::cli {
namespace {

constexpr double kProgress = 5.0;  // s without any: something is wrong

}  // namespace

TrajectoryExperiment::TrajectoryExperiment(ExperimentRunner& runner,
                                           const config::Robot& robot,
                                           const robots::RobotModel& model)
    : runner_(runner), model_(model), arm_names_(config::armList(robot)) {}

safety::RobotVector TrajectoryExperiment::stacked(const dds::JointArray& joints) const {
  safety::RobotVector q(model_.jointCount());
  for (int k = 0; k < model_.armCount(); ++k)
    q.segment(model_.offset(k), model_.size(k)) = dds::jointsOf(joints, k, model_.size(k));
  return q;
}

void TrajectoryExperiment::refuseFault(const client::Snapshot& s, const std::string& when) const {
  for (std::size_t k = 0; k < arm_names_.size(); ++k) {
    const safety::FaultMask faults = s.status.faults[k] | s.state.faults[k];
    if (faults != 0)
      throw RunEnded((when.empty() ? "" : when + ": ") + arm_names_[k] +
                     " is in FAULT: " + safety::describeFaults(faults));
  }
}

std::uint32_t TrajectoryExperiment::placeAtStart(const experiments::RunPlan& plan) {
  client::Client& client = runner_.client();
  client.stateCommand("disable");
  dds::SimRequest reset;
  reset.kind = static_cast<std::uint8_t>(dds::SimKind::kReset);
  reset.arm_count = static_cast<std::uint8_t>(model_.armCount());
  for (int k = 0; k < model_.armCount(); ++k) {
    for (int j = 0; j < model_.size(k); ++j) {
      reset.joints[dds::jointIndex(k, j)] = plan.start[static_cast<std::size_t>(k)][j];
    }
  }
  const std::uint32_t joint_resets = client.snapshot().state.joint_resets;
  client.sim(reset);
  client.setMethod(plan.key.method);
  client.stateCommand("enable");
  return joint_resets;
}

void TrajectoryExperiment::moveToStart(const experiments::RunPlan& plan) {
  client::Client& client = runner_.client();
  constexpr double kBoot = 20.0, kJourney = 600.0;  // s
  const auto valid = [](const client::Snapshot& s) {
    return std::all_of(s.state.valid.begin(), s.state.valid.begin() + s.state.arm_count, [](int v) { return v == 1; });
  };
  const auto faulty = [](const client::Snapshot& s) {
    return std::any_of(s.state.faults.begin(), s.state.faults.begin() + s.state.arm_count,
                       [](auto f) { return f != 0; });
  };
  // What does not come up while everything starts at once gets a second boot.
  client.waitFor(kBoot, [&](const client::Snapshot& s) { return s.states > 0 && (valid(s) || faulty(s)); });
  if (faulty(client.snapshot()))
    client.stateCommand("disable");
  if (!client.waitFor(kBoot, valid))
    throw Failure(kFailure, std::string(idl::name(operation::Reason::kJointsUnknown)) +
                                "; `tandem can monitor` shows nodes that do not start");
  client.stateCommand("disable");
  client.setMethod(plan.key.method);
  client.stateCommand("enable");
  std::uint64_t asked = 0;
  for (int k = 0; k < model_.armCount(); ++k) {
    dds::ControlRequest move;
    move.kind = static_cast<std::uint8_t>(dds::ControlKind::kMoveJp);
    move.arm = static_cast<std::uint8_t>(k);
    move.joint_count = static_cast<std::uint8_t>(model_.size(k));
    for (int j = 0; j < model_.size(k); ++j)
      move.joints[static_cast<std::size_t>(j)] = plan.start[static_cast<std::size_t>(k)][j];
    asked = client.control(move).value;
  }
  const bool there = client.waitFor(kJourney, [&](const client::Snapshot& s) {
    bool busy = s.status.sequence <= asked, latched = false;
    for (std::size_t k = 0; k < s.status.arm_count; ++k) {
      busy = busy || s.status.busy[k] != 0;
      latched = latched || s.status.faults[k] != 0;
    }
    return latched || !busy;
  });
  refuseFault(client.snapshot(), "on the way to the start");
  if (!there)
    throw Failure(kFailure, plan.key.name() + ": the arms did not reach the start");
}

void TrajectoryExperiment::prepare(const experiments::RunPlan& plan) {
  client::Client& client = runner_.client();
  std::uint32_t joint_resets = 0;
  if (runner_.lockStep()) {
    joint_resets = placeAtStart(plan);
  } else {
    moveToStart(plan);
  }
  // Planning must have seen the robot at the start, and enabled, before it lays the trajectory from there.
  const safety::RobotVector wanted = model_.stack(plan.start);
  const client::Snapshot enabled = client.snapshot();
  const bool ready = client.waitFor(client.timeout(kProgress), [&](const client::Snapshot& s) {
    const bool there = runner_.lockStep()
                           ? s.state.joint_resets != joint_resets && s.reference.answers_state == s.state.sequence
                           : (positions(s.state) - wanted).cwiseAbs().maxCoeff() < safety::kPositionTolerance;
    return there && s.reference.answers_control >= enabled.status.sequence;
  });
  if (ready)
    return;
  Eigen::Index joint = 0;
  const double error = (positions(client.snapshot().state) - wanted).cwiseAbs().maxCoeff(&joint);
  int arm = model_.armCount() - 1;
  while (arm > 0 && joint < model_.offset(arm))
    --arm;
  const int own = static_cast<int>(joint) - model_.offset(arm);
  const bool translation = model_.limits()[static_cast<std::size_t>(arm)]->isTranslation(own);
  throw Failure(kFailure, plan.key.name() + ": start configuration not reached; largest joint error " +
                              runtime::jointText(error, translation, "{:.3g}"));
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

bool TrajectoryExperiment::addRow(const RunMessages& messages,
                                  experiments::RunRecord& record,
                                  const dds::PlanningReference& reference) {
  const std::uint64_t before = reference.answers_state, after = before + 1;
  const auto state = messages.states.find(after);
  const auto status = messages.statuses.find(before);
  const auto tips = messages.tips.find(after);
  const auto actions_before = messages.gate_actions.find(before), actions_after = messages.gate_actions.find(after);
  if (state == messages.states.end() || tips == messages.tips.end() || status == messages.statuses.end() ||
      actions_before == messages.gate_actions.end() || actions_after == messages.gate_actions.end()) {
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
bool TrajectoryExperiment::takeLockStep(RunMessages& messages,
                                        experiments::RunRecord& record,
                                        std::uint32_t id,
                                        bool& ended) {
  bool any = false;
  for (; !messages.references.empty(); messages.references.pop_front(), any = true) {
    const dds::PlanningReference& next = messages.references.front();
    const bool ours = next.trajectory_id == id;
    ended = ours && !goesOn(next);
    if (ended)
      return true;
    if (ours && !addRow(messages, record, next))
      return any;
  }
  return any;
}

/// True tips of hardware are unknown; adds the tips of the model at the measured joints.
void TrajectoryExperiment::addModelTips(experiments::StepData& data) {
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
bool TrajectoryExperiment::closeIteration(RunMessages& messages,
                                          experiments::RunRecord& record,
                                          std::uint64_t judged_by) {
  const auto state = messages.states.lower_bound(judged_by);
  if (state == messages.states.end())
    return false;
  experiments::StepData data = dataOf(*open_);
  data.position = positions(state->second);
  data.setpoint = stacked(state->second.setpoint);
  addModelTips(data);
  // The status that answered it, or the one before: a lost sample costs two figures of a row, no row.
  auto status = messages.statuses.upper_bound(open_->sequence);
  if (status != messages.statuses.begin())
    addSolution(std::prev(status)->second, data);
  // Guards are published less often than states: the last word before this state counts.
  auto actions = messages.gate_actions.upper_bound(judged_by);
  const std::uint64_t now =
      actions == messages.gate_actions.begin() ? gate_actions_before_ : std::prev(actions)->second;
  data.gate_actions = now - std::min(now, gate_actions_before_);
  gate_actions_before_ = std::max(now, gate_actions_before_);
  record.add(data);
  messages.states.erase(messages.states.begin(), state);
  open_.reset();
  return true;
}

/// In real time a reference is repeated until control has answered it: an iteration is what has one number.
bool TrajectoryExperiment::takeRealTime(RunMessages& messages,
                                        experiments::RunRecord& record,
                                        std::uint32_t id,
                                        bool& ended) {
  bool any = false;
  for (; !messages.references.empty(); messages.references.pop_front(), any = true) {
    const dds::PlanningReference& next = messages.references.front();
    if (next.trajectory_id != id || (goesOn(next) && next.task_count == 0))
      continue;
    const bool same = open_ && goesOn(next) && next.total_iterations == open_->total_iterations;
    if (same)
      continue;
    if (open_ && !closeIteration(messages, record, next.answers_state))
      return any;
    ended = !goesOn(next);
    if (ended)
      return true;
    open_ = next;
  }
  return any;
}

experiments::RunRecord TrajectoryExperiment::run(const experiments::RunPlan& plan,
                                                 const std::function<void(int, int)>& progress) {
  experiments::RunRecord record(plan.key, model_, plan.trajectory.point_count, plan.trajectory.tolerance);
  try {
    follow(plan, progress, record);
  } catch (const RunEnded& ended) {
    record.fail(ended.what());
  }
  return record;
}

void TrajectoryExperiment::follow(const experiments::RunPlan& plan,
                                  const std::function<void(int, int)>& progress,
                                  experiments::RunRecord& record) {
  prepare(plan);
  gate_actions_before_ = runner_.forget();
  branches_.assign(static_cast<std::size_t>(model_.armCount()), {});
  open_.reset();
  const std::uint32_t id = runner_.start(config::formatTrajectory(plan.trajectory));
  for (bool ended = false; !ended;) {
    const bool progressed = runner_.collect(kProgress, [&](RunMessages& messages) {
      return runner_.lockStep() ? takeLockStep(messages, record, id, ended) : takeRealTime(messages, record, id, ended);
    });
    if (!ended)
      refuseFault(runner_.client().snapshot(), "");
    if (!progressed)
      runner_.failWithoutProgress(kProgress,
                                  fmt::format("after iteration {} of {}", record.rows().size(), plan.key.name()));
    if (progress && !record.rows().empty())
      progress(record.rows().back().data.point, plan.trajectory.point_count);
  }
  refuseFault(runner_.client().snapshot(), "");
}

}  // namespace tandem::cli
