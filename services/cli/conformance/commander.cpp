// SPDX-License-Identifier: Apache-2.0
#include "services/cli/conformance/commander.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>

#include "operation/convert.h"
#include "services/runtime/identity.h"
#include "services/runtime/periodic_loop.h"

namespace tandem::cli {
namespace {

std::int64_t ns(double seconds) { return std::llround(1e9 * seconds); }

/// Slow enough to watch, and at least ten control periods long: 2 mm and 0.1 rad in that time.
SlowMotion slowMotionOf(const config::Deployment& deployment, const config::Robot& robot) {
  constexpr double kTranslation = 2e-3, kRotation = 0.1, kShareOfLimit = 0.5;
  SlowMotion slow;
  slow.seconds = std::max(1.0, 10.0 * deployment.control_period);
  for (std::size_t k = 0; k < robot.arms.size(); ++k) {
    const safety::ArmLimits& limits = robot.arms[k].limits;
    for (int j = 0; j < limits.jointCount(); ++j) {
      const double way = limits.isTranslation(j) ? kTranslation : kRotation;
      slow.speed[dds::jointIndex(static_cast<int>(k), j)] =
          std::min(way / slow.seconds, kShareOfLimit * limits.joints[static_cast<std::size_t>(j)].velocity);
    }
  }
  return slow;
}

}  // namespace

Commander::Commander(const config::Deployment& deployment, const config::Robot& robot, const runtime::StopSignal& stop)
    : deployment_(deployment),
      robot_(robot),
      stop_(stop),
      slow_(slowMotionOf(deployment, robot)),
      session_(runtime::randomIdentity()),
      client_(deployment, {[this](const dds::ActuationState& m) { record(m); }, {}, {}, {}, {}}),
      bus_(runtime::ofAnyRobot(runtime::busOptions(deployment, "conformance", dds::Role::kControl))),
      commands_(bus_.writer(dds::kActuationCommand)) {}

std::vector<dds::Identity> Commander::drives() const {
  std::vector<dds::Identity> found;
  for (const dds::Identity& other : client_.bus().others()) {
    if (other.process == "hal" || other.process == "sim")
      found.push_back(other);
  }
  return found;
}

void Commander::connect(double seconds) {
  const std::int64_t end = runtime::monotonicNow() + ns(seconds);
  const auto complete = [&] {
    const client::Snapshot seen = client_.snapshot();
    const bool answers = client_.clocks().found("hal") || client_.clocks().found("sim");
    return answers && seen.states > 0 && seen.hals > 0 && commands_.matched() > 0;
  };
  while (!complete()) {
    check();
    if (runtime::monotonicNow() < end) {
      silence(0.05);
      continue;
    }
    const client::Snapshot seen = client_.snapshot();
    std::string missing;
    const auto miss = [&](bool there, const char* what) {
      missing += there ? "" : (missing.empty() ? "" : ", ") + std::string(what);
    };
    miss(!drives().empty(), "no identity of a process 'hal' or 'sim'");
    miss(client_.clocks().found("hal") || client_.clocks().found("sim"), "no answer to clock/request");
    miss(seen.states > 0, "no actuation/state with this deployment's fingerprint");
    miss(seen.hals > 0, "no hal/status with this deployment's fingerprint");
    miss(commands_.matched() > 0, "no reader of actuation/command");
    for (const std::string& words : runtime::mismatches(client_.bus()))
      missing += "; " + words;
    throw Failure(kFailure, fmt::format("domain {}, prefix {}: {} within {:.0f} s; start the process of the role hal "
                                        "first, with this deployment, and without control",
                                        deployment_.domain, deployment_.prefix, missing, seconds));
  }
  // A control whose identity has not come yet shows by its commands.
  forget();
  const std::uint64_t answered = state().answers_command;
  if (silence(std::max(1.0, 3.0 * period()), [&](const auto& s) { return s.answers_command != answered; }))
    abort("found that the drives take commands of another process, expected none");
}

void Commander::abort(const std::string& why) {
  if (sequence_ == 0)
    throw Aborted(kFailure, why + "; no command has been sent");
  publishStop("conformance: " + why);
  throw Aborted(kFailure, why + "; the drives have been stopped, the remaining tests have not run");
}

void Commander::check() {
  if (stop_.requested())
    abort("interrupted");
  for (const dds::Identity& other : client_.bus().others()) {
    if (other.process == "control")
      abort("found " + runtime::describe(other) + ", expected no control: this test commands the drives in its place");
  }
  std::string outside;
  double silent = 0.0;
  {
    const std::lock_guard lock(mutex_);
    std::swap(outside, outside_);
    if (!seen_.empty())
      silent = 1e-9 * static_cast<double>(runtime::monotonicNow() - seen_.back().at);
  }
  if (const double longest = std::max(5.0, 10.0 * budget()); silent > longest)
    abort(fmt::format("found no actuation/state for {:.3g} s, expected the process to run", silent));
  if (!outside.empty())
    abort(outside);
}

Commander::Command Commander::next() {
  const dds::ActuationState last = state();
  Command command;
  command.fingerprint = runtime::fingerprintOf(deployment_);
  command.control_session = session_;
  command.sequence = ++sequence_;
  command.state_session = last.session;
  command.answers_state = last.sequence;
  command.arm_count = static_cast<std::uint8_t>(robot_.arms.size());
  command.position = last.setpoint;
  return command;
}

void Commander::send(const Command& command) {
  Command sent = command;
  sent.stamp = runtime::monotonicNow();
  {
    const std::lock_guard lock(mutex_);
    if (!seen_.empty())
      lateness_ = std::max(lateness_, 1e-9 * static_cast<double>(sent.stamp - seen_.back().at));
    sent_.emplace_back(sent.sequence, sent.stamp);
  }
  commands_.write(sent);
}

bool Commander::wait(std::int64_t until, const Condition& condition) {
  constexpr std::int64_t kLook = 50'000'000;  // ns, between two looks at what else can end the test
  for (;;) {
    std::unique_lock lock(mutex_);
    const std::uint64_t arrivals = arrivals_;
    const dds::ActuationState last = seen_.empty() ? dds::ActuationState{} : seen_.back().state;
    lock.unlock();
    if (condition && condition(last))
      return true;
    check();
    const std::int64_t left = std::min(until - runtime::monotonicNow(), kLook);
    if (left <= 0)
      return false;
    lock.lock();
    changed_.wait_for(lock, std::chrono::nanoseconds(left), [&] { return condition && arrivals_ != arrivals; });
  }
}

bool Commander::stream(double seconds, const Change& change, const Condition& until) {
  const std::int64_t step = ns(period()), end = runtime::monotonicNow() + ns(seconds);
  for (std::int64_t due = runtime::monotonicNow(); due < end; due += step) {
    lateness_ = std::max(lateness_, 1e-9 * static_cast<double>(runtime::monotonicNow() - due));
    Command command = next();
    if (change)
      change(command);
    send(command);
    if (wait(due + step, until))
      return true;
  }
  return false;
}

bool Commander::silence(double seconds, const Condition& until) {
  return wait(runtime::monotonicNow() + ns(seconds), until);
}

void Commander::beginSession(std::uint64_t session) {
  session_ = session;
  sequence_ = 0;
}

void Commander::request(safety::DriveRequest request, safety::OperatingState wanted, double seconds) {
  const auto count_in = [&](const dds::ActuationState& s, safety::OperatingState state) {
    return std::ranges::count(std::span(s.operating_state).first(robot_.arms.size()), static_cast<std::uint8_t>(state));
  };
  const auto all = [&](const dds::ActuationState& s) {
    return count_in(s, wanted) == static_cast<std::ptrdiff_t>(robot_.arms.size());
  };
  // Only `disable` leaves FAULT.
  const bool leaves_fault = request == safety::DriveRequest::kDisable;
  const auto decided = [&](const dds::ActuationState& s) {
    return all(s) || (!leaves_fault && count_in(s, safety::OperatingState::kFault) > 0);
  };
  const auto ask = [&](Command& command) { command.request.fill(static_cast<std::uint8_t>(request)); };
  const std::int64_t start = runtime::monotonicNow();
  if (stream(seconds, ask, decided) && all(state()))
    return;
  std::string found;
  const dds::ActuationState last = state();
  for (std::size_t k = 0; k < robot_.arms.size(); ++k) {
    found += fmt::format("{}{} {} ({})", found.empty() ? "" : ", ", robot_.arms[k].name,
                         safety::name(static_cast<safety::OperatingState>(last.operating_state[k])),
                         safety::describeFaults(last.faults[k]));
  }
  const double waited = 1e-9 * static_cast<double>(runtime::monotonicNow() - start);
  throw Failure(kFailure,
                fmt::format("{:.1f} s after the request of a state: found {}, expected {} of every arm; see `tandem "
                            "status`",
                            waited, found, safety::name(wanted)));
}

Commander::Change Commander::slowly() {
  const dds::ActuationState last = state();
  std::array<double, safety::kMaxJoints> velocity{};
  for (std::size_t k = 0; k < robot_.arms.size(); ++k) {
    const int arm = static_cast<int>(k);
    const safety::ArmLimits& limits = robot_.arms[k].limits;
    safety::ArmVector goal = dds::jointsOf(last.setpoint, arm, limits.jointCount());
    for (int j = 0; j < limits.jointCount(); ++j) {
      const std::size_t i = dds::jointIndex(arm, j);
      const double way = 1.5 * slow_.speed[i] * slow_.seconds;  // with what a late stop adds
      const double back = last.setpoint[i] > home_[i] ? -1.0 : 1.0;
      for (const double sign : {back, -back}) {
        safety::ArmVector there = goal;
        there[j] += sign * way;
        if (safety::largestViolation(limits, there) > 0.0)
          continue;
        velocity[i] = sign * slow_.speed[i];
        goal = there;
        break;
      }
    }
  }
  return [this, velocity](Command& command) {
    command.velocity = velocity;
    std::fill_n(command.moving.begin(), robot_.arms.size(), std::uint8_t{1});
    for (std::size_t i = 0; i < velocity.size(); ++i)
      command.position[i] += period() * velocity[i];
  };
}

void Commander::record(const dds::ActuationState& state) {
  const std::lock_guard lock(mutex_);
  seen_.push_back({state, runtime::monotonicNow()});
  ++arrivals_;
  changed_.notify_all();
  if (!start_ || !outside_.empty())
    return;
  forEachJoint([&](int arm, int joint, std::size_t i) {
    const bool translation = isTranslation(arm, joint);
    const double way = std::abs(state.position[i] - start_->position[i]);
    const double range = translation ? translation_range_ : rotation_range_;
    if (way > range && outside_.empty())
      outside_ =
          fmt::format("{} is {:.3g} {} from where it stood, expected at most {:.3g}", nameOf(arm, joint),
                      translation ? 1e3 * way : way, translation ? "mm" : "rad", translation ? 1e3 * range : range);
  });
}

void Commander::permit(double translation, double rotation) {
  const dds::ActuationState now = state();
  const std::lock_guard lock(mutex_);
  start_ = now;
  home_ = now.position;
  translation_range_ = translation;
  rotation_range_ = rotation;
}

dds::ActuationState Commander::state() const {
  const std::lock_guard lock(mutex_);
  return seen_.empty() ? dds::ActuationState{} : seen_.back().state;
}

dds::HalStatus Commander::status() const { return client_.snapshot().hal; }

std::vector<SeenState> Commander::seen() const {
  const std::lock_guard lock(mutex_);
  return seen_;
}

void Commander::forget() {
  const std::lock_guard lock(mutex_);
  if (seen_.size() > 1)
    seen_.erase(seen_.begin(), seen_.end() - 1);
  sent_.clear();
}

std::int64_t Commander::sentAt(std::uint64_t sequence) const {
  const std::lock_guard lock(mutex_);
  for (const auto& [number, at] : sent_) {
    if (number == sequence)
      return at;
  }
  return 0;
}

double Commander::budget() const { return deployment_.budgets.commandAge(deployment_.control_period); }

double Commander::stillness(int arm, int joint) const {
  constexpr double kTranslation = 0.05e-3, kRotation = 2e-3;
  const safety::JointLimit& limit =
      robot_.arms[static_cast<std::size_t>(arm)].limits.joints[static_cast<std::size_t>(joint)];
  return 2.0 * limit.reading_error + (limit.kind == safety::JointKind::kTranslation ? kTranslation : kRotation);
}

void Commander::forEachJoint(const std::function<void(int, int, std::size_t)>& f) const {
  for (int arm = 0; arm < static_cast<int>(robot_.arms.size()); ++arm) {
    for (int joint = 0; joint < robot_.arms[static_cast<std::size_t>(arm)].jointCount(); ++joint)
      f(arm, joint, dds::jointIndex(arm, joint));
  }
}

std::string Commander::nameOf(int arm, int joint) const {
  const config::Arm& of = robot_.arms[static_cast<std::size_t>(arm)];
  return of.name + " " + of.joint_names[static_cast<std::size_t>(joint)];
}

}  // namespace tandem::cli
