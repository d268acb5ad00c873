// SPDX-License-Identifier: Apache-2.0
#include "services/client/motions.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "config/arm_names.h"
#include "config/path.h"
#include "config/robot_files.h"
#include "operation/permission.h"
#include "safety/faults.h"
#include "safety/joint_motion.h"
#include "services/client/arguments.h"

namespace tandem::client {
namespace {

constexpr double kMotionTime = 600.0;       // s
constexpr double kWithdrawTime = 3600.0;    // s
constexpr double kRunTime = 24.0 * 3600.0;  // s
constexpr double kLag = 2.0;                // s, of joints behind their setpoints, and between services
constexpr double kNamed = 3.0;              // s: control publishes its diagnostics once a second
constexpr double kReason =
    0.5;  // s: planning may detect a fault before control reports it, and planning reports its own reason later

dds::ControlRequest controlRequest(dds::ControlKind kind) {
  dds::ControlRequest request;
  request.kind = static_cast<std::uint8_t>(kind);
  return request;
}

bool faulty(const Snapshot& s) {
  return std::any_of(s.status.faults.begin(), s.status.faults.begin() + s.status.arm_count,
                     [](safety::FaultMask faults) { return faults != 0; });
}

bool hasPower(const Snapshot& s) {
  return std::any_of(
      s.status.operating_state.begin(), s.status.operating_state.begin() + s.status.arm_count,
      [](auto state) { return static_cast<safety::OperatingState>(state) == safety::OperatingState::kEnabled; });
}

RunState stateOf(const Snapshot& s) {
  RunState state{static_cast<planning::Phase>(s.reference.phase), s.reference.point, s.reference.point_count,
                 s.reference.total_iterations};
  state.errors.assign(s.status.task_error.begin(), s.status.task_error.begin() + s.status.task_count);
  return state;
}

}  // namespace

std::uint8_t armIndex(const config::Robot& robot, const std::string& arm) {
  if (const auto k = config::findArm(robot, arm))
    return static_cast<std::uint8_t>(*k);
  throw Failure(kUsage, "arm: found '" + arm + "', expected one of: " + config::armNames(robot));
}

int jointIndex(const config::Arm& arm, const std::string& name) {
  const std::vector<std::string> names = arm.joint_names;
  std::string known;
  for (std::size_t j = 0; j < names.size(); ++j) {
    // "b1" is beta_1.
    if (name == names[j] || name == names[j].substr(0, 1) + names[j].substr(names[j].find('_') + 1))
      return static_cast<int>(j);
    known += (j > 0 ? ", " : "") + names[j] + (arm.limits.isTranslation(static_cast<int>(j)) ? " (mm/s)" : " (deg/s)");
  }
  throw Failure(kUsage, "joint: found '" + name + "', expected one of: " + known);
}

std::string jointNamesOf(const config::Arm& arm, safety::JointMask joints) {
  const std::vector<std::string> names = arm.joint_names;
  std::string text;
  for (std::size_t j = 0; j < names.size(); ++j) {
    if ((joints & safety::jointBit(static_cast<int>(j))) != 0)
      text += (text.empty() ? "" : ", ") + names[j];
  }
  return text;
}

/// Possible cause of a timing fault: the largest wake-up delay.
std::string describeLateness(const Snapshot& s, safety::FaultMask faults) {
  const double late = std::max(s.status.jitter_max, s.hal.jitter_max);
  if (!safety::isOfTime(faults) || late <= safety::kLate)
    return {};
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "; largest wake-up delay since the start: %.2g s; run `tandem doctor`", late);
  return text.data();
}

/// Disables interruption during its lifetime.
class Motions::Uninterruptible {
 public:
  explicit Uninterruptible(const Motions& motions) : motions_(motions) { motions_.uninterruptible_(true); }
  ~Uninterruptible() { motions_.uninterruptible_(false); }
  Uninterruptible(const Uninterruptible&) = delete;
  Uninterruptible& operator=(const Uninterruptible&) = delete;

 private:
  const Motions& motions_;
};

Motions::Motions(Client& client,
                 const config::Deployment& deployment,
                 const config::Robot& robot,
                 std::function<void(bool)> uninterruptible,
                 Wait wait)
    : client_(client),
      deployment_(deployment),
      robot_(robot),
      uninterruptible_(std::move(uninterruptible)),
      wait_(std::move(wait)) {
  if (!wait_)
    wait_ = [this](double seconds, const auto& condition) { return client_.waitFor(seconds, condition); };
}

/// @throw Failure that names the first arm in FAULT, and the fault
void Motions::expectNoFault(const Snapshot& s) const {
  for (std::size_t k = 0; k < std::min<std::size_t>(s.status.arm_count, robot_.arms.size()); ++k) {
    if (s.status.faults[k] != 0)
      throw Failure(kFailure, robot_.arms[k].name + " is in FAULT: " + safety::describeFaults(s.status.faults[k]) +
                                  describeLateness(s, s.status.faults[k]) +
                                  "; `tandem robot disable` clears the fault when its cause is gone");
  }
}

/// Pauses the arms after a motion that did not end by itself. @param end_run  called then  @throw Failure that reports
/// this
void Motions::abandon(const std::string& what, const std::function<void()>& end_run) {
  const Uninterruptible guard(*this);
  expectNoFault(client_.snapshot());
  client_.stateCommand("pause");
  if (end_run)
    end_run();
  throw Failure(kFailure, what + "; the arms are paused");
}

void Motions::disable() {
  const Snapshot now = client_.snapshot();
  const auto condition = operation::conditionOf(robot_, now.state, now.status, planning::Phase::kIdle);
  if (!judge(operation::Action::kDisable, operation::Requester::kNoLeaseOwner, condition)) {
    client_.stateCommand("disable");
    return;
  }
  // Power is removed at once; to clear a fault needs the lease, which a client that has just ended may still have.
  try {
    dds::ControlRequest off = controlRequest(dds::ControlKind::kStateCommand);
    off.value = "disable";
    client_.control(off);
  } catch (const Failure&) {
    // Refused only because of the fault; arms that were not in FAULT have no power now.
  }
  wait_(1.5 * deployment_.budgets.lease, [](const Snapshot& s) { return s.status.lease_owner == 0; });
  client_.acquireLease();
  try {
    client_.stateCommand("disable");
  } catch (...) {
    releaseLease();
    throw;
  }
  releaseLease();
}

void Motions::moveJp(std::size_t arm, const Eigen::VectorXd& joints) {
  dds::ControlRequest request = controlRequest(dds::ControlKind::kMoveJp);
  request.arm = static_cast<std::uint8_t>(arm);
  request.joint_count = static_cast<std::uint8_t>(joints.size());
  std::copy(joints.begin(), joints.end(), request.joints.begin());
  const std::uint64_t asked = client_.control(request).value;
  const auto ended = [&](const Snapshot& s) {
    return s.status.faults[arm] != 0 || (s.status.sequence > asked && s.status.busy[arm] == 0);
  };
  const auto reached = [&](const Snapshot& s) {
    for (int j = 0; j < joints.size(); ++j) {
      const double error = s.state.position[dds::jointIndex(static_cast<int>(arm), j)] - joints[j];
      if (std::abs(error) > safety::kPositionTolerance)
        return false;
    }
    return true;
  };
  if (!wait_(kMotionTime, ended) || !wait_(kLag, reached))
    abandon("move_jp ended before the goal was reached");
}

void Motions::recover(const dds::ControlRequest& request) {
  const std::uint64_t asked = client_.control(request).value;
  const std::uint8_t arm = request.arm;
  const auto ended = [&](const Snapshot& s) {
    return s.state.recovery[arm] != 0 || (s.status.sequence > asked && s.status.recovery[arm] == 0);
  };
  if (!wait_(kMotionTime, ended) || client_.snapshot().state.recovery[arm] == 0)
    throw Failure(kFailure, robot_.arms[arm].name +
                                ": the drives give no power: no joint is usable, or a lost joint has not reported a "
                                "valid state since the drives were started; see `tandem status`");
}

void Motions::withdraw(std::uint8_t arm, const std::function<void(const Snapshot&)>& progress) {
  dds::ControlRequest request = controlRequest(dds::ControlKind::kWithdraw);
  request.arm = arm;
  const std::uint64_t asked = client_.control(request).value;
  const bool ended = wait_(kWithdrawTime, [&](const Snapshot& s) {
    progress(s);
    return s.status.faults[arm] != 0 || (s.status.sequence > asked && s.status.busy[arm] == 0);
  });
  if (const safety::FaultMask faults = client_.snapshot().status.faults[arm]; faults != 0)
    throw Failure(kFailure,
                  robot_.arms[arm].name + " is in FAULT: " + safety::describeFaults(faults) +
                      "; it is at standstill, and `tandem robot recover` continues with the remaining joints");
  if (ended)
    return;
  const Uninterruptible guard(*this);
  dds::ControlRequest hold = controlRequest(dds::ControlKind::kHold);  // the other arms continue
  hold.arm = arm;
  client_.control(hold);
  throw Failure(kFailure,
                "the withdrawal was interrupted; the arm is at standstill, and the next `withdraw` continues it");
}

void Motions::home() {
  const std::uint64_t asked = client_.control(controlRequest(dds::ControlKind::kHome)).value;
  const bool there = wait_(kMotionTime, [&](const Snapshot& s) {
    const auto busy = s.status.busy.begin();
    const bool moves = std::any_of(busy, busy + s.status.arm_count, [](auto b) { return b != 0; });
    return faulty(s) || (s.status.sequence > asked && !moves);
  });
  if (!there)
    abandon("the arms did not reach home");
  expectNoFault(client_.snapshot());
}

RunState Motions::run(const Run& run) {
  const bool had_power = hasPower(client_.snapshot());
  client_.stateCommand("enable");
  const std::uint64_t enabled = client_.snapshot().status.sequence;
  wait_(kLag, [&](const Snapshot& s) { return s.reference.answers_control >= enabled; });
  dds::PlanningRequest request;
  request.kind = static_cast<std::uint8_t>(dds::PlanningKind::kStart);
  request.trajectory = run.trajectory;
  request.planned = run.planned ? 1 : 0;
  std::uint32_t id = 0, reported = 0;
  try {
    id = client_.planning(request).value;
  } catch (const Failure&) {
    const Uninterruptible guard(*this);
    if (!had_power)  // undo the enable above
      endCommand(client_);
    throw;
  }
  const auto over = [&](const Snapshot& s) {
    if (faulty(s))
      return true;
    const bool ours = s.reference.trajectory_id == id;
    if (run.progress && ours && s.status.task_count > 0 && s.reference.point != reported) {
      reported = s.reference.point;
      run.progress(stateOf(s));
    }
    const auto phase = static_cast<planning::Phase>(s.reference.phase);
    return ours && phase != planning::Phase::kRunning && phase != planning::Phase::kPaused;
  };
  const auto summarise = [&] {
    const auto received = [id](const Snapshot& s) { return s.summary.trajectory_id == id && s.summaries > 0; };
    return wait_(kReason, received) ? client_.snapshot().summary : dds::RunSummary{};
  };
  if (!waitUntilFinished(run, over)) {
    abandon("interrupted; the run was ended", [&] {
      dds::PlanningRequest end;
      end.kind = static_cast<std::uint8_t>(dds::PlanningKind::kStop);
      client_.planning(end);
      summarise();
    });
  }
  RunState end = stateOf(client_.snapshot());
  if (end.phase == planning::Phase::kFailed)
    wait_(kReason, faulty);
  end.summary = summarise();
  expectNoFault(client_.snapshot());
  if (!run.keep_enabled)
    client_.stateCommand("disable");
  return end;
}

bool Motions::waitUntilFinished(const Run& run, const std::function<bool(const Snapshot&)>& over) {
  std::uint64_t reported = 0;
  const auto pauser = [&](const Snapshot& s) { return s.status.paused_by == client_.id() ? 0 : s.status.paused_by; };
  for (;;) {
    const bool woken = wait_(kRunTime, [&](const Snapshot& s) {
      return over(s) || pauser(s) != reported || (reported != 0 && run.goes_on && run.goes_on());
    });
    const Snapshot now = client_.snapshot();
    if (!woken || over(now))
      return woken;
    if (const std::uint64_t who = pauser(now); who != reported) {
      reported = who;
      if (who != 0 && run.paused)
        run.paused(describePauser(who));
    } else {
      client_.stateCommand("resume");
      reported = 0;
    }
  }
}

/// Waits for the name: that of a client that pauses and ends may come only from control's diagnostics.
std::string Motions::describePauser(std::uint64_t client) const {
  std::string name;
  wait_(kNamed,
        [&](const Snapshot& s) { return s.status.paused_by != client || !(name = client_.nameOfPauser(s)).empty(); });
  return name.empty() ? "another client" : name;
}

std::string runText(const std::string& name_or_path) {
  const auto file = config::findFile(name_or_path, "trajectory|path");
  return config::kindOf(file) == "path" ? config::formatPath(config::loadPath(file))
                                        : config::formatTrajectory(config::loadTrajectory(file));
}

void takeCommand(Client& client, std::function<bool()> interrupted) {
  client.setInterrupt(std::move(interrupted));
  client.connect(client.timeout(20.0));
  client.acquireLease();
}

void endCommand(Client& client) noexcept {
  try {
    client.stateCommand("disable");
    client.releaseLease();
  } catch (const std::exception&) {
    // The system stops with this process or before it; there is no receiver for an error.
  }
}

void stopAndWait(Client& client, const std::string& reason) {
  client.stop(reason);
  const bool stopped = client.waitFor(kLag, [](const Snapshot& s) {
    const auto& faults = s.state.faults;
    return s.states > 0 &&
           std::all_of(faults.begin(), faults.begin() + s.state.arm_count, [](auto f) { return f != 0; }) &&
           std::all_of(s.state.velocity.begin(), s.state.velocity.end(), [](double v) { return v == 0.0; });
  });
  if (!stopped)
    throw Failure(kFailure,
                  "stop was sent, but the drives do not report standstill; check that `tandem up` is running");
  client.stop(reason);  // for recordings and pages that were discovered after control and drives
}

void Motions::releaseLease() noexcept {
  const Uninterruptible guard(*this);
  try {
    client_.releaseLease();
    constexpr double kShown = 0.5;  // s: the reply may arrive before the status that shows the release
    client_.waitFor(kShown, [this](const Snapshot& s) { return s.status.lease_owner != client_.id(); });
  } catch (const std::exception&) {
    // Without a reply the lease expires without its heartbeat.
  }
}

}  // namespace tandem::client
