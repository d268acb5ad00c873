// SPDX-License-Identifier: Apache-2.0
#include "python/bindings/live_robot.h"

#include <algorithm>
#include <chrono>

#include "planning/follower.h"
#include "safety/faults.h"
#include "safety/joint_motion.h"
#include "services/cli/arguments.h"

namespace tandem::python {
namespace {

using cli::Failure;
using cli::Snapshot;
using Clock = std::chrono::steady_clock;

constexpr double kConnectTime = 10.0;  // s
constexpr double kMotionTime = 600.0;  // s
constexpr double kRunTime = 24.0 * 3600.0;
constexpr double kLag = 2.0;  // s, of joints behind their setpoints

double since(std::int64_t ns) { return 1e-9 * static_cast<double>(Clock::now().time_since_epoch().count() - ns); }

dds::ControlRequest controlRequest(dds::ControlKind kind) {
  dds::ControlRequest request;
  request.kind = static_cast<std::uint8_t>(kind);
  return request;
}

bool faulty(const Snapshot& s) {
  return std::any_of(s.status.faults.begin(), s.status.faults.begin() + s.status.arm_count,
                     [](safety::FaultMask faults) { return faults != 0; });
}

RunState stateOf(const Snapshot& s) {
  RunState state{s.reference.point, s.reference.point_count, s.reference.total_iterations, {}};
  state.errors.assign(s.status.task_error.begin(), s.status.task_error.begin() + s.status.task_count);
  return state;
}

}  // namespace

LiveRobot::Command::Command(LiveRobot& live, bool lease)
    : live_(live), alone_(live.command_, std::try_to_lock), lease_(false) {
  if (!alone_)
    throw Failure(cli::kFailure, "another command of this client is under way; stop() alone may come between");
  if (!live_.connected_)
    live_.connect(kConnectTime);
  if (lease) {
    lease_ = true;  // whatever becomes of the request
    try {
      live_.client_->acquireLease();
    } catch (...) {
      live_.giveLeaseBack();
      throw;
    }
  }
}

LiveRobot::Command::~Command() {
  if (lease_)
    live_.giveLeaseBack();
}

LiveRobot::LiveRobot(const std::string& deployment)
    : deployment_(config::loadDeployment(config::findFile(deployment, "deployment"))),
      robot_(config::loadRobot(deployment_.robot)),
      patience_(2.0 + 3.0 * deployment_.control_period) {
  cli::Client::Taps taps;
  taps.status = [this](const dds::ControlStatus&) { heard_ = Clock::now().time_since_epoch().count(); };
  client_ = std::make_unique<cli::Client>(deployment_, std::move(taps));
  client_->interruptBy([this] { return interrupted_ && !cleaning_; });
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
  if (since(heard_) > patience_)
    throw Failure(cli::kFailure, "control has fallen silent; is `tandem up` still running?");
  return client_->snapshot();
}

dds::PoseStamped LiveRobot::measuredTip(std::size_t arm) {
  snapshot();
  Pose& pose = *poses_[arm];
  const auto known = [&pose] {
    const std::lock_guard lock(pose.mutex);
    return pose.value;
  };
  if (!client_->waitFor(kLag, [&](const Snapshot&) { return known().has_value(); }))
    throw Failure(cli::kFailure, "control does not say where the tip of " + robot_.arms[arm].name + " is");
  return *known();
}

bool LiveRobot::waitFor(double seconds, const std::function<bool(const Snapshot&)>& condition) {
  bool silent = false;
  const bool answer = client_->waitFor(seconds, [&](const Snapshot& s) {
    silent = since(heard_) > patience_;
    return silent || condition(s);
  });
  if (silent)
    throw Failure(cli::kFailure, "control has fallen silent; is `tandem up` still running?");
  return answer;
}

void LiveRobot::giveLeaseBack() noexcept {
  cleaning_ = true;
  try {
    client_->releaseLease();
  } catch (const std::exception&) {
    // Who does not answer has forgotten it, or will: nobody keeps it alive any more.
  }
  cleaning_ = false;
}

void LiveRobot::expectNoFault(const Snapshot& s) const {
  for (std::size_t k = 0; k < std::min<std::size_t>(s.status.arm_count, robot_.arms.size()); ++k) {
    if (s.status.faults[k] != 0)
      throw Failure(cli::kFailure, robot_.arms[k].name + " is in FAULT: " + safety::describeFaults(s.status.faults[k]));
  }
}

void LiveRobot::abandon(const std::string& what, bool trajectory) {
  cleaning_ = true;
  try {
    expectNoFault(client_->snapshot());
    client_->stateCommand("pause");
    if (trajectory) {
      dds::PlanningRequest give_up;
      give_up.kind = 4;
      client_->planning(give_up);
    }
  } catch (...) {
    cleaning_ = false;
    throw;
  }
  cleaning_ = false;
  throw Failure(cli::kFailure, what + "; the arms are paused");
}

void LiveRobot::disable() {
  const Snapshot now = client_->snapshot();
  const bool fault =
      faulty(now) || std::any_of(now.state.faults.begin(), now.state.faults.begin() + now.state.arm_count,
                                 [](safety::FaultMask faults) { return faults != 0; });
  if (!fault) {
    client_->stateCommand("disable");
    return;
  }
  // Power goes at once; a fault is cleared under the lease, which whoever has just gone may still hold.
  try {
    dds::ControlRequest off = controlRequest(dds::ControlKind::kStateCommand);
    off.value = "disable";
    client_->control(off);
  } catch (const Failure&) {
    // Refused for the fault alone; whatever was not in FAULT has no power now.
  }
  waitFor(1.5 * deployment_.budgets.lease, [](const Snapshot& s) { return s.status.lease_holder == 0; });
  client_->acquireLease();
  try {
    client_->stateCommand("disable");
  } catch (...) {
    giveLeaseBack();
    throw;
  }
  giveLeaseBack();
}

void LiveRobot::stateCommand(const std::string& command) {
  const Command one(*this, command == "enable" || command == "resume");
  if (command == "disable")
    disable();
  else
    client_->stateCommand(command);
}

void LiveRobot::setMethod(control::Method method) {
  const Command one(*this, true);
  client_->setMethod(method);
}

void LiveRobot::setParameter(const std::string& name, const std::string& value) {
  const Command one(*this, true);
  dds::ControlRequest request = controlRequest(dds::ControlKind::kSetParameter);
  request.text = name;
  request.value = value;
  client_->control(request);
}

void LiveRobot::moveJp(std::size_t arm, const Eigen::VectorXd& joints) {
  const Command one(*this, true);
  dds::ControlRequest request = controlRequest(dds::ControlKind::kMoveJp);
  request.arm = static_cast<std::uint8_t>(arm);
  request.joint_count = static_cast<std::uint8_t>(joints.size());
  std::copy(joints.begin(), joints.end(), request.joints.begin());
  const std::uint64_t asked = client_->control(request).value;
  const auto ended = [&](const Snapshot& s) {
    return s.status.faults[arm] != 0 || (s.status.sequence > asked && s.status.busy[arm] == 0);
  };
  const auto reached = [&](const Snapshot& s) {
    for (int j = 0; j < joints.size(); ++j) {
      const double error = s.state.position[dds::jointIndex(static_cast<int>(arm), j)] - joints[j];
      if (std::abs(error) > safety::kAtRest)
        return false;
    }
    return true;
  };
  if (!waitFor(kMotionTime, ended) || !waitFor(kLag, reached))
    abandon("move_jp ended before the goal was reached", false);
}

void LiveRobot::home() {
  const Command one(*this, true);
  const std::uint64_t asked = client_->control(controlRequest(dds::ControlKind::kHome)).value;
  const bool there = waitFor(kMotionTime, [&](const Snapshot& s) {
    const auto busy = s.status.busy.begin();
    const bool moves = std::any_of(busy, busy + s.status.arm_count, [](auto b) { return b != 0; });
    return faulty(s) || (s.status.sequence > asked && !moves);
  });
  if (!there)
    abandon("the arms did not get home", false);
  expectNoFault(client_->snapshot());
}

RunState LiveRobot::run(const std::string& trajectory,
                        std::optional<control::Method> method,
                        bool keep_enabled,
                        const std::function<void(const RunState&)>& news) {
  const Command one(*this, true);
  if (method)
    client_->setMethod(*method);
  client_->stateCommand("enable");
  const std::uint64_t enabled = client_->snapshot().status.sequence;
  waitFor(kLag, [&](const Snapshot& s) { return s.reference.answers_control >= enabled; });
  dds::PlanningRequest request;
  request.kind = 1;
  request.trajectory = trajectory;
  const std::uint32_t id = client_->planning(request).value;
  std::uint32_t told = 0;
  const bool ended = waitFor(kRunTime, [&](const Snapshot& s) {
    if (faulty(s))
      return true;
    const bool ours = s.reference.trajectory_id == id;
    if (ours && s.status.task_count > 0 && s.reference.point != told) {
      told = s.reference.point;
      news(stateOf(s));
    }
    const auto phase = static_cast<planning::Phase>(s.reference.phase);
    return ours && phase != planning::Phase::kRunning && phase != planning::Phase::kPaused;
  });
  if (!ended)
    abandon("interrupted; the trajectory is given up", true);
  const auto phase = static_cast<planning::Phase>(client_->snapshot().reference.phase);
  constexpr double kReason = 0.5;  // s: planning may notice a fault before control says which one it is
  if (phase == planning::Phase::kFailed)
    waitFor(kReason, faulty);
  const Snapshot last = client_->snapshot();
  expectNoFault(last);
  if (!keep_enabled)
    client_->stateCommand("disable");
  const RunState state = stateOf(last);
  if (phase != planning::Phase::kFinished)
    throw Failure(cli::kFailure, "the run has " + std::string(planning::name(phase)) + " at point " +
                                     std::to_string(state.point) + " of " + std::to_string(state.points) + ", after " +
                                     std::to_string(state.iterations) + " iterations");
  return state;
}

void LiveRobot::stop(const std::string& reason) {
  client_->stop(reason);
  const bool stopped = client_->waitFor(kLag, [](const Snapshot& s) {
    const auto& faults = s.state.faults;
    return s.states > 0 &&
           std::all_of(faults.begin(), faults.begin() + s.state.arm_count, [](auto f) { return f != 0; }) &&
           std::all_of(s.state.velocity.begin(), s.state.velocity.end(), [](double v) { return v == 0.0; });
  });
  if (!stopped)
    throw Failure(cli::kFailure, "stop was sent, but the drives do not report standstill; is `tandem up` running?");
}

}  // namespace tandem::python
