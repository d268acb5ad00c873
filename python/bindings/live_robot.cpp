// SPDX-License-Identifier: Apache-2.0
#include "python/bindings/live_robot.h"

#include <algorithm>
#include <chrono>

#include "config/robot_files.h"
#include "services/client/arguments.h"
#include "services/runtime/process.h"

namespace tandem::python {
namespace {

using client::Failure;
using client::RunState;
using client::Snapshot;
using Clock = std::chrono::steady_clock;

constexpr double kConnectTime = 10.0;  // s
constexpr double kPoseTime = 2.0;      // s, until control's first pose is received

double since(std::int64_t ns) { return 1e-9 * static_cast<double>(Clock::now().time_since_epoch().count() - ns); }

}  // namespace

LiveRobot::Command::Command(LiveRobot& live, bool lease)
    : live_(live), alone_(live.command_, std::try_to_lock), lease_(false) {
  if (!alone_)
    throw Failure(client::kFailure,
                  "another command of this client is in progress; only stop() may be called meanwhile");
  if (!live_.connected_)
    live_.connect(kConnectTime);
  if (lease) {
    lease_ = true;  // even if the request fails
    try {
      live_.client_->acquireLease();
    } catch (...) {
      live_.motions_->releaseLease();
      throw;
    }
  }
}

LiveRobot::Command::~Command() {
  if (lease_)
    live_.motions_->releaseLease();
}

LiveRobot::LiveRobot(const std::string& deployment)
    : deployment_(runtime::loadDeployment(deployment)),
      robot_(config::loadAnyRobot(deployment_)),
      timeout_(2.0 + 3.0 * deployment_.control_period) {
  client::Client::Callbacks callbacks;
  callbacks.status = [this](const dds::ControlStatus&) { received_ = Clock::now().time_since_epoch().count(); };
  client_ = std::make_unique<client::Client>(deployment_, std::move(callbacks));
  client_->setInterrupt([this] { return interrupted_ && !uninterruptible_; });
  motions_.emplace(
      *client_, deployment_, robot_, [this](bool uninterruptible) { uninterruptible_ = uninterruptible; },
      [this](double seconds, const auto& condition) { return waitFor(seconds, condition); });
  for (const config::Arm& arm : robot_.arms) {
    Pose& pose = *poses_.emplace_back(std::make_unique<Pose>());
    readers_.push_back(client_->bus().reader(dds::kMeasuredCp, arm.name, [&pose](const dds::PoseStamped& message) {
      const std::lock_guard lock(pose.mutex);
      pose.value = message;
    }));
  }
}

void LiveRobot::connect(double seconds) {
  client_->connect(seconds);
  connected_ = true;
}

Snapshot LiveRobot::snapshot() {
  if (!connected_)
    connect(kConnectTime);
  if (since(received_) > timeout_)
    throw Failure(client::kFailure, "no recent message from control; check that `tandem up` is running");
  return client_->snapshot();
}

dds::PoseStamped LiveRobot::measuredTip(std::size_t arm) {
  snapshot();
  Pose& pose = *poses_[arm];
  const auto known = [&pose] {
    const std::lock_guard lock(pose.mutex);
    return pose.value;
  };
  if (!client_->waitFor(kPoseTime, [&](const Snapshot&) { return known().has_value(); }))
    throw Failure(client::kFailure, "no tip pose of " + robot_.arms[arm].name + " received from control");
  return *known();
}

bool LiveRobot::waitFor(double seconds, const std::function<bool(const Snapshot&)>& condition) {
  bool silent = false;
  const bool answer = client_->waitFor(seconds, [&](const Snapshot& s) {
    silent = since(received_) > timeout_;
    return silent || condition(s);
  });
  if (silent)
    throw Failure(client::kFailure, "no recent message from control; check that `tandem up` is running");
  return answer;
}

void LiveRobot::stateCommand(const std::string& command) {
  const Command one(*this, command == "enable" || command == "resume");
  if (command == "disable")
    motions_->disable();
  else
    client_->stateCommand(command);
}

void LiveRobot::setMethod(control::Method method) {
  const Command one(*this, true);
  client_->setMethod(method);
}

void LiveRobot::setParameter(const std::string& name, const std::string& value) {
  const Command one(*this, true);
  dds::ControlRequest request;
  request.kind = static_cast<std::uint8_t>(dds::ControlKind::kSetParameter);
  request.text = name;
  request.value = value;
  client_->control(request);
}

void LiveRobot::moveJp(std::size_t arm, const Eigen::VectorXd& joints) {
  const Command one(*this, true);
  motions_->moveJp(arm, joints);
}

void LiveRobot::home() {
  const Command one(*this, true);
  motions_->home();
}

RunState LiveRobot::run(const std::string& trajectory,
                        std::optional<control::Method> method,
                        bool keep_enabled,
                        const std::function<void(const RunState&)>& progress) {
  const Command one(*this, true);
  if (method)
    client_->setMethod(*method);
  RunState state = motions_->run({trajectory, false, keep_enabled, progress});
  if (state.phase != planning::Phase::kFinished)
    throw Failure(client::kFailure, "the run has " + std::string(planning::name(state.phase)) + " at point " +
                                        std::to_string(state.point) + " of " + std::to_string(state.points) +
                                        ", after " + std::to_string(state.iterations) + " iterations" +
                                        (state.summary.reason.empty() ? "" : ": " + state.summary.reason));
  return state;
}

void LiveRobot::stop(const std::string& reason) { client::stopAndWait(*client_, reason); }

}  // namespace tandem::python
