// SPDX-License-Identifier: Apache-2.0
/** @file tandem-sim: simulated robot, with the same topics as tandem-hal. */
#include <spdlog/spdlog.h>

#include <atomic>
#include <cmath>
#include <numeric>
#include <optional>
#include <thread>

#include "robots/capability.h"
#include "services/runtime/clock_request_handler.h"
#include "services/runtime/drive_shell.h"
#include "services/runtime/mailbox.h"
#include "services/simulation/mechanism_tips.h"
#include "services/simulation/sim_core.h"

using namespace tandem;

namespace {

/** Log of arms of the plant that snap from one equilibrium to another. */
class SnapLog {
 public:
  explicit SnapLog(const config::Robot& robot) : robot_(robot) {}

  /// @return values for `diagnostics`
  runtime::Details details(const dds::HalStatus& status) {
    for (std::size_t k = 0; k < status.arm_count; ++k) {
      if (status.snaps[k] != reported_[k])
        spdlog::warn("{}: the simulated arm snapped into another equilibrium ({} times so far)", robot_.arms[k].name,
                     status.snaps[k]);
    }
    reported_ = status.snaps;
    return {{"snaps", std::to_string(std::accumulate(reported_.begin(), reported_.end(), std::uint64_t{0}))}};
  }

 private:
  const config::Robot& robot_;
  dds::PerArm<std::uint32_t> reported_{};
};

std::optional<simulation::MechanismTips> mechanismTipsOf(const runtime::Setup& setup) {
  if (!has(setup.robot, robots::Capability::kCommonPath))
    return std::nullopt;
  return std::optional<simulation::MechanismTips>(std::in_place, setup);
}

/** Lock-step: commands advance the simulated time. */
class LockStep {
 public:
  explicit LockStep(const runtime::Setup& setup)
      : setup_(setup),
        core_(setup),
        mechanism_(mechanismTipsOf(setup)),
        bus_(runtime::busOptions(setup.deployment, setup.name)),
        states_(bus_.writer(dds::kActuationState)),
        statuses_(bus_.writer(dds::kHalStatus)),
        replies_(bus_.writer(dds::kSimReply)),
        true_tips_(bus_.writer(dds::kSimTips)),
        diagnostics_(bus_, setup),
        snaps_(setup.robot) {
    if (core_.tracking())
      measured_tips_ = bus_.writer(dds::kSensingTips);
    core_.state(runtime::monotonicNow(), state_);
  }

  void run(const runtime::StopSignal& stop) {
    const auto put = [this](const auto& message) { loop_.put(message); };
    const runtime::MismatchHandler mismatches(
        bus_, [this](const dds::Reply& reply) { replies_.write(reply); }, [put] { put(dds::Mismatch{}); });
    const auto commands = bus_.reader(dds::kActuationCommand, put);
    const auto requests = bus_.reader(dds::kSimRequest, put);
    const auto stops = bus_.reader(dds::kStop, put);
    const runtime::ClockRequestHandler clock(bus_, setup_);
    spdlog::info("ready: robot {}, lock-step", setup_.robot.name);
    constexpr double kRepeat = 0.1;  // s: period of repetitions of the state, for processes that start later
    loop_.run(setup_, stop, kRepeat, [this](const auto& message) { take(message); });
  }

 private:
  void take(std::monostate) { publish(); }
  void take(const dds::ActuationCommand& command) {
    if (core_.onCommand(command, runtime::monotonicNow()))
      publishNext();
  }
  void take(const dds::SimRequest& request) {
    const dds::Reply reply = core_.onRequest(request);
    publishNext();
    replies_.write(reply);
  }
  void take(const dds::Mismatch&) {
    core_.onMismatch();
    publishNext();
  }
  void take(const dds::Stop& stop) {
    spdlog::error("stop: {}", stop.reason);
    core_.onStop();
    publishNext();
  }

  void publishNext() {
    core_.state(runtime::monotonicNow(), state_);
    publish();
  }

  void publish() {
    core_.status(status_);
    statuses_.write(status_);
    core_.trueTips(tips_);
    if (mechanism_) {
      core_.plantJoints(snapshot_);
      tips_ = mechanism_->at(snapshot_);
    }
    true_tips_.write(tips_);
    // Every state is published with tips, new or not: receivers that need both wait for both.
    if (core_.tracking()) {
      core_.measuredTips(tips_);
      measured_tips_.write(tips_);
    }
    states_.write(state_);
    watch_.look(core_, core_.armCount(), [this](const auto& report) { runtime::logFault(setup_.robot, report); });
    runtime::diagnose(diagnostics_, setup_.robot, status_, snaps_.details(status_));
  }

  const runtime::Setup& setup_;
  simulation::SimCore core_;
  std::optional<simulation::MechanismTips> mechanism_;
  simulation::MechanismSnapshot snapshot_;
  runtime::EventLoop<dds::ActuationCommand, dds::SimRequest, dds::Stop, dds::Mismatch> loop_;
  dds::Bus bus_;
  dds::Writer<dds::ActuationState> states_;
  dds::Writer<dds::HalStatus> statuses_;
  dds::Writer<dds::Reply> replies_;
  dds::Writer<dds::TipPoses> true_tips_, measured_tips_;
  runtime::Diagnostics diagnostics_;
  runtime::FaultWatch watch_;
  SnapLog snaps_;
  dds::ActuationState state_;
  dds::HalStatus status_;
  dds::TipPoses tips_;
};

/** Real time: a periodic thread without DDS calls. A DDS thread handles requests between two steps. */
class RealTime {
 public:
  explicit RealTime(const runtime::Setup& setup)
      : core_(setup),
        mechanism_(mechanismTipsOf(setup)),
        snaps_(setup.robot),
        shell_(setup, setup.deployment.sim_period, [this](const auto& m) { return snaps_.details(m); }),
        replies_(shell_.bus().writer(dds::kSimReply)),
        true_tips_(shell_.bus().writer(dds::kSimTips)),
        tips_out_(shell_.outbox().latest<dds::TipPoses>([this](const auto& m) { measured_tips_.write(m); })),
        true_tips_out_(shell_.publisher().latest<dds::TipPoses>([this](const auto& m) { true_tips_.write(m); })),
        snapshot_out_(places_.latest<simulation::MechanismSnapshot>(
            [this](const auto& m) { true_tips_.write(mechanism_->at(m)); })),
        period_(std::llround(1e9 * setup.deployment.sim_period)) {
    if (core_.tracking())
      measured_tips_ = shell_.bus().writer(dds::kSensingTips);
  }

  void run(const std::string& robot, const runtime::StopSignal& stop) {
    places_.start();
    shell_.refuseMismatches([this](const dds::Reply& reply) { replies_.write(reply); });
    const auto requests = shell_.bus().reader(dds::kSimRequest, [this](const dds::SimRequest& m) { onRequest(m); });
    shell_.run("robot " + robot, [&](const runtime::Tick& tick) {
      in_cycle_ = true;
      cycle(tick);
      in_cycle_ = false;
      return !stop.requested();
    });
    places_.stop();
  }

 private:
  /// Requests reset the robot or inject a fault: they are rare, and they allocate. The periodic thread does not access
  /// the core meanwhile, and catches up afterwards.
  void onRequest(const dds::SimRequest& request) {
    serving_ = true;
    while (in_cycle_)
      std::this_thread::yield();
    const dds::Reply reply = core_.onRequest(request);
    serving_ = false;
    replies_.write(reply);
  }

  /// Periods that have passed so far, the first cycle's included.
  std::uint64_t periodsDue(const runtime::Tick& tick) noexcept {
    if (tick.cycle == 1)
      start_ = tick.scheduled - period_;
    return static_cast<std::uint64_t>((tick.now - start_) / period_);
  }

  void cycle(const runtime::Tick& tick) noexcept {
    const std::uint64_t due = periodsDue(tick);
    // The drives wait while a request is handled; a cycle directly after a late one has no period to simulate.
    if (serving_ || due == stepped_)
      return;
    // The missed periods precede the command and the stop that are available now.
    if (due > stepped_ + 1)
      core_.catchUp(due - stepped_ - 1, tick.now - period_);
    stepped_ = due;
    shell_.take(core_, tick.now);
    core_.step(tick.now);
    shell_.show(core_, tick);
    if (core_.tracking() && core_.measuredTips(tips_))
      tips_out_.post(tips_);
    if (shell_.isStatusCycle(tick))
      postTrueTips();
  }

  void postTrueTips() noexcept {
    if (mechanism_) {
      core_.plantJoints(snapshot_);
      snapshot_out_.post(snapshot_);
    } else {
      core_.trueTips(tips_);
      true_tips_out_.post(tips_);
    }
  }

  simulation::SimCore core_;
  std::optional<simulation::MechanismTips> mechanism_;
  simulation::MechanismSnapshot snapshot_;
  SnapLog snaps_;
  runtime::DriveShell shell_;
  dds::Writer<dds::Reply> replies_;
  dds::Writer<dds::TipPoses> true_tips_, measured_tips_;
  runtime::Outbox places_;  ///< for tips of arms that move a common object, which take long to compute
  runtime::Outbox::Latest<dds::TipPoses>& tips_out_;
  runtime::Outbox::Latest<dds::TipPoses>& true_tips_out_;
  runtime::Outbox::Latest<simulation::MechanismSnapshot>& snapshot_out_;
  std::atomic<bool> serving_{false}, in_cycle_{false};
  std::int64_t period_, start_ = 0;  ///< ns
  std::uint64_t stepped_ = 0;        ///< periods simulated so far
  dds::TipPoses tips_;
};

void run(const runtime::Setup& setup, runtime::StopSignal& stop) {
  if (setup.deployment.clock == config::ClockMode::kLockStep)
    LockStep(setup).run(stop);
  else
    RealTime(setup).run(setup.robot.name, stop);
}

}  // namespace

int main(int argc, char** argv) {
  return runtime::runService(argc, argv, "sim", "Simulates the robot, with the topics, states and gate of tandem-hal.",
                             run);
}
