// SPDX-License-Identifier: Apache-2.0
#include "services/planning/planning_core.h"

#include <spdlog/spdlog.h>

#include <cmath>

#include "operation/convert.h"
#include "operation/permission.h"
#include "robots/capability.h"
#include "safety/operating_state.h"
#include "services/dds/reply.h"
#include "services/runtime/periodic_loop.h"

namespace tandem::planning_service {
namespace {

using dds::replyTo;

/// An operator or a CRTK client commands the robot.
bool operated(const dds::ControlStatus& status) {
  const auto source = static_cast<dds::Source>(status.source);
  return source == dds::Source::kTeleoperation || source == dds::Source::kCrtk;
}

}  // namespace

PlanningCore::PlanningCore(const runtime::Setup& setup)
    : setup_(setup),
      lock_step_(setup.deployment.clock == config::ClockMode::kLockStep),
      ros_time_(lock_step_),
      robot_(setup.robot, setup.deployment.model),
      sensor_(setup.deployment.feedback == planning::Feedback::kSensor),
      run_(robots::makeRun(setup.robot, robot_, setup.deployment.control_period)),
      trajectory_id_(static_cast<std::uint32_t>(runtime::randomIdentity())),
      recorder_(setup.robot) {
  sensor_tips_.orientations = setup.deployment.orientation_feedback;
}

bool PlanningCore::active() const {
  const planning::Phase phase = run_->progress().phase;
  return phase == planning::Phase::kRunning || phase == planning::Phase::kPaused;
}

/// The branch of an elastic arm depends on its history, so every state is processed, also without a running trajectory.
void PlanningCore::followState() {
  safety::RobotVector q;
  if (dds::measuredJoints(state_, robot_.armCount(), robot_.jointCount(), q))
    run_->observe(q);
}

robots::Measured PlanningCore::measured() const {
  robots::Measured now;
  if (state_.sequence == 0 || state_.arm_count != robot_.armCount() || !complete())
    return now;
  dds::measuredJoints(state_, robot_.armCount(), robot_.jointCount(), now.joints);
  for (std::size_t k = 0; k < state_.arm_count; ++k)
    now.valid[k] = state_.valid[k] != 0;
  now.tips = sensor_ ? &sensor_tips_ : nullptr;
  return now;
}

void PlanningCore::onTips(const dds::TipPoses& tips) {
  if (tips.state_session != tips_message_.state_session)
    sensor_tips_.forget();
  tips_message_ = tips;
  dds::takeTips(tips, sensor_tips_);
  if (waiting_) {
    advanceInStep();
  } else if (lock_step_ && !active()) {
    publish();
  }
}

/// Lock-step: whether all messages of the present state have been received.
bool PlanningCore::complete() const {
  return !lock_step_ || !sensor_ ||
         (tips_message_.state_session == state_.session && tips_message_.answers_state >= state_.sequence);
}

void PlanningCore::advanceInStep() {
  waiting_ = !complete();
  if (!waiting_)
    advance();
}

void PlanningCore::onState(const dds::ActuationState& state) {
  const bool new_instant = state.session != state_.session || state.stamp != state_.stamp;
  const bool new_state = state.session != state_.session || state.sequence != state_.sequence;
  if (state.session != state_.session || state.joint_resets != state_.joint_resets) {
    if (state_.session != 0)
      run_->restart();
  }
  state_ = state;
  waiting_ = waiting_ && !new_state;
  followState();
  if (active() && state.session != session_at_start_) {
    end("the robot restarted");
    return;
  }
  if (!lock_step_ || !new_state)
    return;
  if (active() && new_instant) {
    advanceInStep();
  } else {
    publish();
  }
}

void PlanningCore::onClearances(const dds::Clearances& clearances) {
  if (active())
    recorder_.add(clearances);
}

void PlanningCore::onStatus(const dds::ControlStatus& status) {
  const bool control_restarted = status_.session != 0 && status.session != status_.session;
  status_ = status;
  if (!active())
    return publish();
  if (control_restarted)
    return end("control restarted");
  if (status.lease_owner != commander_)
    return end("the client that started the run released or lost the control lease");
  if (operated(status))
    return end("an operator has taken over");
  recorder_.add(status);
  bool enabled = true;
  for (std::size_t k = 0; k < status.arm_count; ++k) {
    const auto state = static_cast<safety::OperatingState>(status.operating_state[k]);
    // A pause does not end the run; loss of power does, so that a later `enable` moves nothing.
    if (state == safety::OperatingState::kDisabled || state == safety::OperatingState::kFault) {
      return end(setup_.robot.arms[k].name + " became " + std::string(safety::name(state)));
    }
    enabled = enabled && state == safety::OperatingState::kEnabled;
  }
  if (lock_step_)
    return;
  // While control holds the trajectory, no new reference is generated. References are repeated; because of network
  // delay, a status that answers any repetition of the present one is sufficient.
  const bool answered = status.answers_reference >= asked_since_ && status.answers_reference <= sequence_;
  if (enabled && status.hold == 0 && answered) {
    advance();
  } else {
    publish();
  }
}

void PlanningCore::end(const std::string& why) {
  spdlog::error("trajectory {} ends: {}", trajectory_id_, why);
  ended_ = why;
  run_->fail();
  summarise();
  publish();
}

void PlanningCore::refresh() {
  // In lock-step each state triggers the next reference of a running trajectory; control would answer a repeated one
  // twice.
  if (!lock_step_ || !active())
    publish();
}

void PlanningCore::advance() {
  if (const std::string why = run_->update(measured(), reference_); !why.empty())
    return end(why);
  asked_since_ = sequence_ + 1;
  if (!active()) {
    ended_ = describeMisses(run_->progress());
    spdlog::info("trajectory {}: {}{}", trajectory_id_, planning::name(run_->progress().phase),
                 ended_.empty() ? "" : ": " + ended_);
    summarise();
  }
  publish();
}

void PlanningCore::publish() {
  const planning::Progress& progress = run_->progress();
  dds::PlanningReference message;
  message.sequence = ++sequence_;
  message.state_session = state_.session;
  message.answers_state = complete() ? state_.sequence : 0;
  message.answers_control = status_.sequence;
  message.stamp = now();
  message.trajectory_id = trajectory_id_;
  message.point = static_cast<std::uint32_t>(progress.point);
  message.point_count = static_cast<std::uint32_t>(progress.point_count);
  message.iteration = static_cast<std::uint32_t>(progress.iteration);
  message.total_iterations = static_cast<std::uint32_t>(progress.total_iterations);
  message.phase = static_cast<std::uint8_t>(progress.phase);
  message.tolerance = run_->tolerance();
  if (active() && progress.total_iterations > 0)
    dds::setTasks(reference_, message);
  if (message.task_count > 0)
    dds::setPosture(reference_.posture, state_.arm_count, state_.joint_count, message);
  outgoing_ = message;
}

std::int64_t PlanningCore::now() const { return lock_step_ ? state_.stamp : runtime::monotonicNow(); }

void PlanningCore::summarise() {
  summary_ = recorder_.summary(now(), gate_interventions_, *run_, reference_, ended_);
  summary_->trajectory_id = trajectory_id_;
}

std::optional<dds::PlanningReference> PlanningCore::take() { return std::exchange(outgoing_, std::nullopt); }

std::optional<dds::RunSummary> PlanningCore::takeSummary() { return std::exchange(summary_, std::nullopt); }

dds::Reply PlanningCore::onRequest(const dds::PlanningRequest& request, std::optional<dds::Path>& path) {
  using Kind = dds::PlanningKind;
  const auto kind = static_cast<Kind>(request.kind);
  const auto action = kind == Kind::kStart ? operation::Action::kStart : operation::Action::kSteer;
  const auto condition = operation::conditionOf(setup_.robot, state_, status_, run_->progress().phase);
  const auto refusal = judge(action, operation::requesterOf(request.client, status_.lease_owner), condition);
  if (kind != Kind::kStop && refusal)
    return replyTo(request, refusal.code(), describe(refusal, setup_.robot));
  switch (kind) {
    case Kind::kStart:
      return start(request, path);
    case Kind::kPause:
      run_->pause();
      break;
    case Kind::kResume:
      run_->resume();
      break;
    case Kind::kStop:
      if (active()) {
        run_->stop();
        summarise();
      }
      break;
    default:
      return replyTo(request, dds::ReplyCode::kUnknown, "unknown kind of request " + std::to_string(request.kind));
  }
  publish();
  return replyTo(request, dds::ReplyCode::kOk, "");
}

/// Reason why a trajectory cannot run with its planned joints; empty if it can.
std::string PlanningCore::unplanned(const dds::PlanningRequest& request) const {
  constexpr double kAway = 5e-4, kTurned = 5e-3;  // m, rad: noise of encoders
  if (!plan_ || plan_->trajectory != request.trajectory || plan_->start.size() != robot_.jointCount())
    return "planned: this trajectory has not been checked as feasible; run a check first (`tandem plan check -d`)";
  for (int k = 0; k < robot_.armCount(); ++k) {
    for (int j = 0; j < robot_.size(k); ++j) {
      const double away = std::abs(state_.position[dds::jointIndex(k, j)] - plan_->start[robot_.offset(k) + j]);
      if (!(away <= (robot_.limits()[static_cast<std::size_t>(k)]->isTranslation(j) ? kAway : kTurned)))
        return "planned: the trajectory was checked from other joints than the present ones of " +
               setup_.robot.arms[static_cast<std::size_t>(k)].name + "; check it again";
    }
  }
  return "";
}

dds::Reply PlanningCore::start(const dds::PlanningRequest& request, std::optional<dds::Path>& path) {
  const bool planned = request.planned != 0;
  const std::string cannot = planned ? refusal(setup_.robot, robots::Capability::kComputation) : "";
  if (!cannot.empty())
    return replyTo(request, dds::ReplyCode::kMalformed, "planned: found 1; " + cannot);
  if (const std::string why = planned ? unplanned(request) : ""; !why.empty())
    return replyTo(request, dds::ReplyCode::kWrongState, why);
  try {
    auto postures = planned ? plan_->points : std::vector<safety::RobotVector>{};
    if (const std::string why = run_->start(request.trajectory, measured(), std::move(postures)); !why.empty())
      return replyTo(request, dds::ReplyCode::kFailed, why);
  } catch (const std::exception& error) {
    return replyTo(request, dds::ReplyCode::kMalformed, error.what());
  }
  path = pathOf(run_->points());
  ++trajectory_id_;
  ended_.clear();
  session_at_start_ = state_.session;
  commander_ = request.client;
  recorder_.start(now(), gate_interventions_);
  spdlog::info("trajectory {}: '{}', {} points", trajectory_id_, run_->name(), run_->progress().point_count);
  advance();
  return replyTo(request, dds::ReplyCode::kOk, "", trajectory_id_);
}

dds::Path PlanningCore::pathOf(const std::vector<Eigen::Isometry3d>& points) {
  dds::Path path;
  path.stamp = ros_time_.of(now());
  path.frame = setup_.deployment.prefix + "_base";
  for (const Eigen::Isometry3d& point : points) {
    dds::PoseStamped pose;
    pose.stamp = path.stamp;
    pose.frame = path.frame;
    Eigen::Vector3d::Map(pose.position.data()) = point.translation();
    Eigen::Vector4d::Map(pose.orientation.data()) = Eigen::Quaterniond(point.linear()).coeffs();  // x y z w
    path.poses.push_back(pose);
  }
  return path;
}

}  // namespace tandem::planning_service
