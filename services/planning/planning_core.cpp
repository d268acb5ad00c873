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

namespace tandem::service {
namespace {

using dds::replyTo;

/// Somebody moves the robot by hand.
bool operated(const dds::ControlStatus& status) {
  const auto source = static_cast<dds::Source>(status.source);
  return source == dds::Source::kTeleoperation || source == dds::Source::kCrtk;
}

}  // namespace

PlanningCore::PlanningCore(const Setup& setup)
    : setup_(setup),
      lock_step_(setup.deployment.clock == config::ClockMode::kLockStep),
      robot_(setup.robot, setup.deployment.model),
      sensor_(setup.deployment.feedback == planning::Feedback::kSensor),
      model_tips_(has(setup.robot, robots::Capability::kTips) ? planning::TipFollower(robot_.models())
                                                              : planning::TipFollower()),
      follower_(setup.deployment.control_period),
      trajectory_id_(static_cast<std::uint32_t>(randomIdentity())) {
  if (has(setup.robot, robots::Capability::kCommonPath))
    paths_.emplace(setup);
}

bool PlanningCore::active() const {
  const planning::Phase phase = progress().phase;
  return phase == planning::Phase::kRunning || phase == planning::Phase::kPaused;
}

/// Elastic arms remember their way, so every state is followed, whether a trajectory runs or not.
void PlanningCore::followState() {
  safety::RobotVector q;
  if (!paths_ && dds::measuredJoints(state_, robot_.armCount(), robot_.jointCount(), q))
    model_tips_.update(q);
}

bool PlanningCore::measured(const planning::TrajectorySpec& spec,
                            Eigen::Vector3d& tip,
                            Eigen::Vector3d& relative) const {
  if (state_.sequence == 0 || state_.arm_count != robot_.armCount() || !complete())
    return false;
  std::array<Eigen::Vector3d, 2> tips;
  for (const auto& [k, to] : {std::pair{spec.arm, &tips[0]}, std::pair{spec.other_arm, &tips[1]}}) {
    const auto i = static_cast<std::size_t>(k);
    if (state_.valid[i] == 0 || (sensor_ && !sensor_tips_.arm[i].known))
      return false;
    *to = sensor_ ? sensor_tips_.arm[i].position : Eigen::Vector3d(model_tips_.tip(k).pose.translation());
  }
  tip = tips[0];
  relative = tips[0] - tips[1];
  return model_tips_.status() == kinematics::ModelStatus::kOk;
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

/// Lock-step: whether everything that belongs to the present state is here.
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
  if (state.session != state_.session || state.placements != state_.placements) {
    model_tips_.restart();
    if (paths_ && state_.session != 0)
      paths_->restart();
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

void PlanningCore::onStatus(const dds::ControlStatus& status) {
  const bool control_restarted = status_.session != 0 && status.session != status_.session;
  status_ = status;
  if (!active())
    return publish();
  if (control_restarted)
    return end("control restarted");
  if (status.lease_holder != commander_)
    return end("its commander gave up or lost the control lease");
  if (operated(status))
    return end("an operator has taken over");
  bool enabled = true;
  for (std::size_t k = 0; k < status.arm_count; ++k) {
    const auto state = static_cast<safety::OperatingState>(status.operating_state[k]);
    // A pause is a pause; without power the run is over, so that a later `enable` moves nothing.
    if (state == safety::OperatingState::kDisabled || state == safety::OperatingState::kFault) {
      return end(setup_.robot.arms[k].name + " became " + std::string(safety::name(state)));
    }
    enabled = enabled && state == safety::OperatingState::kEnabled;
  }
  if (lock_step_)
    return;
  // While control holds the trajectory, it does not run away from it.
  // A reference is repeated; the answer to any repetition of the present one will do, for over a network it is late.
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
  follower_.fail();
  if (paths_)
    paths_->fail();
  publish();
}

void PlanningCore::refresh() {
  // In lock-step the chain of states drives a running trajectory; a repeated reference would be answered twice.
  if (!lock_step_ || !active())
    publish();
}

void PlanningCore::advance() {
  if (paths_) {
    safety::RobotVector q;
    if (!dds::measuredJoints(state_, robot_.armCount(), robot_.jointCount(), q))
      return end("the measured joints are not valid");
    paths_->update(q, reference_);
    if (!paths_->why().empty())
      return end(paths_->why());
  } else if (!advanceTips()) {
    return end(sensor_ ? "the measured joints or tips are not valid" : "the measured joints are not valid");
  }
  asked_since_ = sequence_ + 1;
  if (!active())
    spdlog::info("trajectory {}: {}", trajectory_id_, planning::name(progress().phase));
  publish();
}

bool PlanningCore::advanceTips() {
  Eigen::Vector3d tip, relative;
  if (!measured(follower_.spec(), tip, relative))
    return false;
  follower_.update(tip, relative, reference_);
  return true;
}

void PlanningCore::publish() {
  const planning::Progress& progress = this->progress();
  dds::PlanningReference message;
  message.sequence = ++sequence_;
  message.state_session = state_.session;
  message.answers_state = complete() ? state_.sequence : 0;
  message.answers_control = status_.sequence;
  message.stamp = lock_step_ ? state_.stamp : monotonicNow();
  message.trajectory_id = trajectory_id_;
  message.point = static_cast<std::uint32_t>(progress.point);
  message.point_count = static_cast<std::uint32_t>(progress.point_count);
  message.iteration = static_cast<std::uint32_t>(progress.iteration);
  message.total_iterations = static_cast<std::uint32_t>(progress.total_iterations);
  message.phase = static_cast<std::uint8_t>(progress.phase);
  message.tolerance = paths_ ? PathFollower::kTolerance : follower_.spec().tolerance;
  if (active() && progress.total_iterations > 0)
    dds::setTasks(reference_, message);
  if (message.task_count > 0)
    dds::setPosture(reference_.posture, state_.arm_count, state_.joint_count, message);
  outgoing_ = message;
}

std::optional<dds::PlanningReference> PlanningCore::take() { return std::exchange(outgoing_, std::nullopt); }

dds::Reply PlanningCore::onRequest(const dds::PlanningRequest& request, std::optional<dds::Path>& path) {
  using Kind = dds::PlanningKind;
  const auto kind = static_cast<Kind>(request.kind);
  const auto action = kind == Kind::kStart ? operation::Action::kStart : operation::Action::kSteer;
  const auto situation = operation::situationOf(setup_.robot, state_, status_, progress().phase);
  const auto refusal = judge(action, operation::askerOf(request.client, status_.lease_holder), situation);
  if (kind != Kind::kStop && refusal)
    return replyTo(request, refusal.code(), describe(refusal, setup_.robot));
  switch (kind) {
    case Kind::kStart:
      return start(request, path);
    case Kind::kPause:
      paths_ ? paths_->pause() : follower_.pause();
      break;
    case Kind::kResume:
      paths_ ? paths_->resume() : follower_.resume();
      break;
    case Kind::kStop:
      paths_ ? paths_->stop() : follower_.stop();
      break;
    default:
      return replyTo(request, dds::ReplyCode::kUnknown, "unknown kind of request " + std::to_string(request.kind));
  }
  publish();
  return replyTo(request, dds::ReplyCode::kOk, "");
}

/// Why a trajectory cannot be run as it was planned; empty if it can.
std::string PlanningCore::unplanned(const dds::PlanningRequest& request) const {
  constexpr double kAway = 5e-4, kTurned = 5e-3;  // m, rad: noise of encoders
  if (!plan_ || plan_->trajectory != request.trajectory || plan_->start.size() != robot_.jointCount())
    return "planned: no feasible check of this trajectory is known; check it first";
  for (int k = 0; k < robot_.armCount(); ++k) {
    for (int j = 0; j < robot_.size(k); ++j) {
      const double away = std::abs(state_.position[dds::jointIndex(k, j)] - plan_->start[robot_.offset(k) + j]);
      if (!(away <= (j < robot_.size(k) / 2 ? kAway : kTurned)))
        return "planned: the trajectory was checked from other joints than those of " +
               setup_.robot.arms[static_cast<std::size_t>(k)].name + " now; check it again";
    }
  }
  return "";
}

dds::Reply PlanningCore::start(const dds::PlanningRequest& request, std::optional<dds::Path>& path) {
  if (paths_)
    return startPath(request, path);
  planning::TrajectorySpec spec;
  try {
    spec = config::parseTrajectory(request.trajectory, "planning/request", {});  // names no files
  } catch (const std::exception& error) {
    return replyTo(request, dds::ReplyCode::kMalformed, error.what());
  }
  for (const int arm : {spec.arm, spec.other_arm}) {
    if (arm < 0 || arm >= robot_.armCount() || spec.arm == spec.other_arm) {
      return replyTo(request, dds::ReplyCode::kMalformed,
                     "arm and other_arm: expected two different arms of the " + std::to_string(robot_.armCount()));
    }
  }
  Eigen::Vector3d tip, relative;
  if (!measured(spec, tip, relative)) {
    return replyTo(request, dds::ReplyCode::kFailed, "no valid actuation/state yet");
  }
  if (const std::string why = request.planned != 0 ? unplanned(request) : ""; !why.empty())
    return replyTo(request, dds::ReplyCode::kWrongState, why);
  try {
    follower_.start(spec, tip, relative, request.planned != 0 ? plan_->points : std::vector<safety::RobotVector>{});
  } catch (const std::exception& error) {
    return replyTo(request, dds::ReplyCode::kMalformed, error.what());
  }
  std::vector<Eigen::Isometry3d> points;
  for (const planning::TrajectoryPoint& point : follower_.points())
    points.emplace_back(Eigen::Translation3d(point.tip));
  path = pathOf(points);
  return begun(request, spec.name);
}

/// A run has been started: it goes on from here.
dds::Reply PlanningCore::begun(const dds::PlanningRequest& request, const std::string& name) {
  ++trajectory_id_;
  ended_.clear();
  session_at_start_ = state_.session;
  commander_ = request.client;
  spdlog::info("trajectory {}: '{}', {} points", trajectory_id_, name, progress().point_count);
  advance();
  return replyTo(request, dds::ReplyCode::kOk, "", trajectory_id_);
}

dds::Path PlanningCore::pathOf(const std::vector<Eigen::Isometry3d>& points) const {
  dds::Path path;
  path.stamp = state_.stamp;
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

dds::Reply PlanningCore::startPath(const dds::PlanningRequest& request, std::optional<dds::Path>& path) {
  if (request.planned != 0)
    return replyTo(request, dds::ReplyCode::kMalformed,
                   "planned: found 1; " + refusal(setup_.robot, robots::Capability::kComputation));
  safety::RobotVector q;
  if (!dds::measuredJoints(state_, robot_.armCount(), robot_.jointCount(), q))
    return replyTo(request, dds::ReplyCode::kFailed, "no valid actuation/state yet");
  try {
    if (const std::string why = paths_->start(request.trajectory, q); !why.empty())
      return replyTo(request, dds::ReplyCode::kFailed, why);
  } catch (const std::exception& error) {
    return replyTo(request, dds::ReplyCode::kMalformed, error.what());
  }
  path = pathOf(paths_->points());
  return begun(request, paths_->path().name);
}

}  // namespace tandem::service
