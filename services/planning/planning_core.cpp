// SPDX-License-Identifier: Apache-2.0
#include "services/planning/planning_core.h"

#include <spdlog/spdlog.h>

#include "safety/operating_state.h"
#include "services/common/periodic_loop.h"
#include "services/dds/convert.h"

namespace tandem::service {
namespace {

enum RequestKind : std::uint8_t { kStart = 1, kPause, kResume, kStop };

dds::Reply reply(const dds::PlanningRequest& request, dds::ReplyCode code, std::string reason) {
  dds::Reply reply;
  reply.client = request.client;
  reply.request = request.request;
  reply.accepted = code == dds::ReplyCode::kOk ? 1 : 0;
  reply.code = static_cast<std::uint16_t>(code);
  reply.reason = std::move(reason);
  return reply;
}

}  // namespace

PlanningCore::PlanningCore(const Setup& setup)
    : setup_(setup),
      lock_step_(setup.deployment.clock == config::ClockMode::kLockStep),
      robot_(setup.robot),
      follower_(setup.deployment.control_period),
      trajectory_id_(static_cast<std::uint32_t>(randomIdentity())) {}

bool PlanningCore::active() const {
  const planning::Phase phase = follower_.progress().phase;
  return phase == planning::Phase::kRunning || phase == planning::Phase::kPaused;
}

bool PlanningCore::measured(const planning::TrajectorySpec& spec,
                            Eigen::Vector3d& tip,
                            Eigen::Vector3d& relative) const {
  if (state_.sequence == 0 || state_.arm_count != robot_.armCount())
    return false;
  safety::RobotVector q(robot_.jointCount());
  for (int k = 0; k < robot_.armCount(); ++k) {
    if (state_.valid[static_cast<std::size_t>(k)] == 0)
      return false;
    for (int j = 0; j < robot_.size(k); ++j) {
      q[robot_.offset(k) + j] = state_.position[dds::jointIndex(k, j)];
    }
  }
  try {
    tip = robot_.tip(spec.arm, q);
    relative = tip - robot_.tip(spec.other_arm, q);
  } catch (const std::domain_error&) {
    return false;
  }
  return true;
}

void PlanningCore::onState(const dds::ActuationState& state) {
  const bool new_instant = state.session != state_.session || state.stamp != state_.stamp;
  const bool new_state = state.session != state_.session || state.sequence != state_.sequence;
  state_ = state;
  if (active() && state.session != session_at_start_) {
    end("the robot restarted");
    return;
  }
  if (!lock_step_ || !new_state)
    return;
  if (active() && new_instant) {
    advance();
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
  if (enabled && status.answers_reference == sequence_) {
    advance();
  } else {
    publish();
  }
}

void PlanningCore::end(const std::string& why) {
  spdlog::error("trajectory {} ends: {}", trajectory_id_, why);
  follower_.fail();
  publish();
}

void PlanningCore::refresh() {
  // In lock-step the chain of states drives a running trajectory; a repeated reference would be answered twice.
  if (!lock_step_ || !active())
    publish();
}

void PlanningCore::advance() {
  Eigen::Vector3d tip, relative;
  if (!measured(follower_.spec(), tip, relative)) {
    return end("the measured joints are not valid");
  }
  follower_.update(tip, relative, reference_);
  if (!active())
    spdlog::info("trajectory {}: {}", trajectory_id_, planning::name(follower_.progress().phase));
  publish();
}

void PlanningCore::publish() {
  const planning::Progress& progress = follower_.progress();
  dds::PlanningReference message;
  message.sequence = ++sequence_;
  message.state_session = state_.session;
  message.answers_state = state_.sequence;
  message.answers_control = status_.sequence;
  message.stamp = lock_step_ ? state_.stamp : monotonicNow();
  message.trajectory_id = trajectory_id_;
  message.point = static_cast<std::uint32_t>(progress.point);
  message.point_count = static_cast<std::uint32_t>(progress.point_count);
  message.iteration = static_cast<std::uint32_t>(progress.iteration);
  message.total_iterations = static_cast<std::uint32_t>(progress.total_iterations);
  message.phase = static_cast<std::uint8_t>(progress.phase);
  message.tolerance = follower_.spec().tolerance;
  if (active() && progress.total_iterations > 0)
    dds::setTasks(reference_, message);
  outgoing_ = message;
}

std::optional<dds::PlanningReference> PlanningCore::take() { return std::exchange(outgoing_, std::nullopt); }

dds::Reply PlanningCore::onRequest(const dds::PlanningRequest& request, std::optional<dds::Path>& path) {
  if (request.kind != kStop && (status_.lease_holder == 0 || status_.lease_holder != request.client)) {
    return reply(request, dds::ReplyCode::kNotLeaseHolder, "only the holder of the control lease commands planning");
  }
  switch (request.kind) {
    case kStart:
      return start(request, path);
    case kPause:
      follower_.pause();
      break;
    case kResume:
      follower_.resume();
      break;
    case kStop:
      follower_.stop();
      break;
    default:
      return reply(request, dds::ReplyCode::kUnknown, "unknown kind of request " + std::to_string(request.kind));
  }
  publish();
  return reply(request, dds::ReplyCode::kOk, "");
}

dds::Reply PlanningCore::start(const dds::PlanningRequest& request, std::optional<dds::Path>& path) {
  if (active())
    return reply(request, dds::ReplyCode::kBusy, "a trajectory is running; stop it first");
  planning::TrajectorySpec spec;
  try {
    spec = config::parseTrajectory(request.trajectory, "planning/request", {});  // names no files
  } catch (const std::exception& error) {
    return reply(request, dds::ReplyCode::kMalformed, error.what());
  }
  for (const int arm : {spec.arm, spec.other_arm}) {
    if (arm < 0 || arm >= robot_.armCount() || spec.arm == spec.other_arm) {
      return reply(request, dds::ReplyCode::kMalformed,
                   "arm and other_arm: expected two different arms of the " + std::to_string(robot_.armCount()));
    }
  }
  for (std::size_t k = 0; k < status_.arm_count; ++k) {
    if (status_.operating_state[k] != static_cast<std::uint8_t>(safety::OperatingState::kEnabled)) {
      return reply(request, dds::ReplyCode::kWrongState,
                   setup_.robot.arms[k].name + " is not ENABLED; enable it first");
    }
  }
  Eigen::Vector3d tip, relative;
  if (!measured(spec, tip, relative)) {
    return reply(request, dds::ReplyCode::kFailed, "no valid actuation/state yet");
  }
  try {
    follower_.start(spec, tip, relative);
  } catch (const std::exception& error) {
    return reply(request, dds::ReplyCode::kMalformed, error.what());
  }
  ++trajectory_id_;
  session_at_start_ = state_.session;
  commander_ = request.client;
  spdlog::info("trajectory {}: '{}', {} points", trajectory_id_, spec.name, spec.point_count);
  path.emplace();
  path->stamp = state_.stamp;
  path->frame = setup_.deployment.prefix + "_base";
  for (const planning::TrajectoryPoint& point : follower_.points()) {
    dds::PoseStamped pose;
    pose.stamp = path->stamp;
    pose.frame = path->frame;
    pose.position = {point.tip.x(), point.tip.y(), point.tip.z()};
    path->poses.push_back(pose);
  }
  dds::Reply answer = reply(request, dds::ReplyCode::kOk, "");
  answer.value = trajectory_id_;
  advance();
  return answer;
}

}  // namespace tandem::service
