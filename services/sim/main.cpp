// SPDX-License-Identifier: Apache-2.0
/** @file tandem-sim: the simulated robot, in the HAL's place. */
#include <spdlog/spdlog.h>

#include <atomic>
#include <cmath>
#include <numeric>
#include <variant>

#include "services/common/latest_value.h"
#include "services/common/mailbox.h"
#include "services/common/outbox.h"
#include "services/common/periodic_loop.h"
#include "services/setup/actuation.h"
#include "services/setup/clock_desk.h"
#include "services/setup/fault_log.h"
#include "services/sim/catheter_tips.h"
#include "services/sim/sim_core.h"

using namespace tandem;

namespace {

/** Tells of arms of the plant that snap from one equilibrium into another. */
class SnapLog {
 public:
  void tell(const config::Robot& robot, const dds::HalStatus& status) {
    for (std::size_t k = 0; k < status.arm_count; ++k) {
      if (status.snaps[k] != told_[k])
        spdlog::warn("{}: the plant snapped into another equilibrium, {} times so far", robot.arms[k].name,
                     status.snaps[k]);
    }
    told_ = status.snaps;
  }

 private:
  dds::PerArm<std::uint32_t> told_{};
};

void tellHealth(service::Diagnostics& diagnostics, const config::Robot& robot, const dds::HalStatus& status) {
  const std::uint64_t snaps = std::accumulate(status.snaps.begin(), status.snaps.end(), std::uint64_t{0});
  service::diagnose(diagnostics, robot, status, {{"snaps", std::to_string(snaps)}});
}

/** Lock-step: commands move the time. */
void runLockStep(const service::Setup& setup, service::StopSignal& stop) {
  using Event = std::variant<dds::ActuationCommand, dds::SimRequest, dds::Stop>;
  service::SimCore core(setup);
  std::optional<service::CatheterTips> catheters;
  if (setup.robot.catheters)
    catheters.emplace(setup);
  service::CatheterMoment moment;
  service::Mailbox<Event> mailbox;
  dds::Bus bus(service::busOptions(setup.deployment, setup.name));
  auto states = bus.writer(dds::kActuationState);
  auto statuses = bus.writer(dds::kHalStatus);
  auto replies = bus.writer(dds::kSimReply);
  auto true_tips = bus.writer(dds::kSimTips);
  dds::Writer<dds::TipPoses> measured_tips;
  if (core.tracking())
    measured_tips = bus.writer(dds::kSensingTips);
  const auto put = [&](const auto& message) { mailbox.put(message); };
  service::Diagnostics diagnostics(bus, setup.name, setup.robot.name);
  auto commands = bus.reader(dds::kActuationCommand, put);
  auto requests = bus.reader(dds::kSimRequest, put);
  auto stops = bus.reader(dds::kStop, put);
  const service::ClockDesk clock(bus, setup);

  service::FaultWatch watch;
  dds::ActuationState state;
  dds::HalStatus status;
  dds::TipPoses tips;
  SnapLog snaps;
  core.state(service::monotonicNow(), state);
  const auto publish = [&](bool fresh) {
    if (fresh)
      core.state(service::monotonicNow(), state);
    core.status(status);
    statuses.write(status);
    core.trueTips(tips);
    if (catheters) {
      core.trueJoints(moment);
      tips = catheters->at(moment);
    }
    true_tips.write(tips);
    // Every state has its tips, new ones or not: who needs both waits for both.
    if (core.tracking()) {
      core.measuredTips(tips);
      measured_tips.write(tips);
    }
    states.write(state);
    snaps.tell(setup.robot, status);
    for (int k = 0; k < core.armCount(); ++k) {
      if (watch.fresh(k, core.faultRecord(k)))
        service::logFault(setup.robot, {k, core.faultRecord(k)});
    }
    tellHealth(diagnostics, setup.robot, status);
  };
  spdlog::info("ready: robot {}, lock-step", setup.robot.name);
  constexpr double kRepeat = 0.1;  // s: whoever came late hears the present state
  while (!stop.requested()) {
    const auto event = mailbox.take(kRepeat);
    setup.heartbeat->beat();
    if (!event) {
      publish(false);
    } else if (const auto* command = std::get_if<dds::ActuationCommand>(&*event)) {
      if (core.onCommand(*command, service::monotonicNow()))
        publish(true);
    } else if (const auto* request = std::get_if<dds::SimRequest>(&*event)) {
      const dds::Reply reply = core.onRequest(*request);
      publish(true);
      replies.write(reply);
    } else {
      spdlog::error("stop: {}", std::get<dds::Stop>(*event).reason);
      core.onStop();
      publish(true);
    }
  }
}

/** Real time: a periodic thread that never sees DDS. Requests wait for a gap between two steps in their own thread's
 * mailbox. */
class RealTime {
 public:
  explicit RealTime(const service::Setup& setup)
      : setup_(setup),
        core_(setup),
        loop_(setup.deployment.sim_period),
        status_every_(std::max<std::uint64_t>(
            1,
            static_cast<std::uint64_t>(setup.deployment.status_period / setup.deployment.sim_period))),
        bus_(service::busOptions(setup.deployment, setup.name)),
        states_(bus_.writer(dds::kActuationState)),
        statuses_(bus_.writer(dds::kHalStatus)),
        replies_(bus_.writer(dds::kSimReply)),
        true_tips_(bus_.writer(dds::kSimTips)),
        true_tips_out_(outbox_.latest<dds::TipPoses>([this](const auto& m) { true_tips_.write(m); })),
        tips_out_(outbox_.latest<dds::TipPoses>([this](const auto& m) { measured_tips_.write(m); })),
        state_out_(outbox_.latest<dds::ActuationState>([this](const auto& m) { states_.write(m); })),
        beats_out_(outbox_.latest<service::LoopStatistics>([this](const auto& m) { setup_.heartbeat->beat(m); })),
        diagnostics_(bus_, setup.name, setup.robot.name),
        status_out_(outbox_.latest<dds::HalStatus>([this](const auto& m) {
          statuses_.write(m);
          snaps_.tell(setup_.robot, m);
          tellHealth(diagnostics_, setup_.robot, m);
        })),
        fault_out_(outbox_.queue<service::FaultReport>(
            64,
            [this](const auto& report) { service::logFault(setup_.robot, report); })),
        moment_out_(
            places_.latest<service::CatheterMoment>([this](const auto& m) { true_tips_.write(catheters_->at(m)); })),
        period_(std::llround(1e9 * setup.deployment.sim_period)) {
    if (setup.robot.catheters)
      catheters_.emplace(setup);
    if (core_.tracking())
      measured_tips_ = bus_.writer(dds::kSensingTips);
  }

  void run(service::StopSignal& stop) {
    outbox_.start();
    places_.start();
    auto commands = bus_.reader(dds::kActuationCommand, [this](const dds::ActuationCommand& m) { command_.store(m); });
    auto requests = bus_.reader(dds::kSimRequest, [this](const dds::SimRequest& m) { onRequest(m); });
    auto stops = bus_.reader(dds::kStop, [this](const dds::Stop& m) {
      spdlog::error("stop: {}", m.reason);
      stop_requested_ = true;
    });
    const auto emergencies = service::listenForEmergencyStop(bus_, setup_, emergency_);
    const service::ClockDesk clock(bus_, setup_);
    for (const auto& refusal :
         service::enterRealtime(setup_.deployment.realtime_priority, setup_.deployment.lock_memory)) {
      spdlog::warn("{}", refusal);
    }
    spdlog::info("ready: robot {}, period {} s", setup_.robot.name, loop_.period());
    loop_.run([&](const service::Tick& tick) {
      cycle(tick);
      return !stop.requested();
    });
    ended_ = true;
    outbox_.stop();
    places_.stop();
  }

 private:
  /// Requests reset the robot or break an axis: rare, and they allocate. The periodic thread leaves the core alone
  /// while one is served, and makes up for the time.
  void onRequest(const dds::SimRequest& request) {
    serving_ = true;
    while (in_cycle_.load() && !ended_)
      std::this_thread::yield();
    const dds::Reply reply = core_.onRequest(request);
    serving_ = false;
    replies_.write(reply);
  }

  /// How many periods have passed by now, the first cycle's included.
  std::uint64_t periodsDue(const service::Tick& tick) noexcept {
    if (tick.cycle == 1)
      start_ = tick.scheduled - period_;
    return static_cast<std::uint64_t>((tick.now - start_) / period_);
  }

  void cycle(const service::Tick& tick) noexcept {
    in_cycle_ = true;
    const std::uint64_t due = periodsDue(tick);
    // While a request is served the drives wait; a cycle right behind a late one has nothing to do.
    if (serving_ || due == stepped_) {
      in_cycle_ = false;
      return;
    }
    // What went by was before the command and the stop that are here now.
    if (due > stepped_ + 1)
      core_.catchUp(due - stepped_ - 1, tick.now - period_);
    stepped_ = due;
    dds::ActuationCommand command;
    if (command_.take(command))
      core_.onCommand(command, tick.now);
    if (stop_requested_.exchange(false))
      core_.onStop();
    if (const std::uint8_t told = emergency_.exchange(0, std::memory_order_relaxed); told != 0)
      core_.onEmergencyStop(told == service::kPressedReport, tick.now);
    core_.step(tick.now);
    core_.state(tick.now, state_);
    state_out_.post(state_);
    beats_out_.post(loop_.statistics());
    if (core_.tracking() && core_.measuredTips(tips_))
      tips_out_.post(tips_);
    for (int k = 0; k < core_.armCount(); ++k) {
      if (fault_watch_.fresh(k, core_.faultRecord(k)))
        fault_out_.post({k, core_.faultRecord(k)});
    }
    if (tick.cycle % status_every_ == 0) {
      if (catheters_) {
        core_.trueJoints(moment_);
        moment_out_.post(moment_);
      } else {
        core_.trueTips(tips_);
        true_tips_out_.post(tips_);
      }
      core_.status(status_);
      service::writeLoop(loop_, status_);
      status_out_.post(status_);
    }
    in_cycle_ = false;
  }

  const service::Setup& setup_;
  service::SimCore core_;
  service::PeriodicLoop loop_;
  std::uint64_t status_every_;
  dds::Bus bus_;
  dds::Writer<dds::ActuationState> states_;
  dds::Writer<dds::HalStatus> statuses_;
  dds::Writer<dds::Reply> replies_;
  dds::Writer<dds::TipPoses> true_tips_, measured_tips_;
  service::Outbox outbox_;
  service::Outbox::Latest<dds::TipPoses>& true_tips_out_;
  service::Outbox::Latest<dds::TipPoses>& tips_out_;
  service::Outbox::Latest<dds::ActuationState>& state_out_;
  service::Outbox::Latest<service::LoopStatistics>& beats_out_;
  service::Diagnostics diagnostics_;
  service::Outbox::Latest<dds::HalStatus>& status_out_;
  service::Outbox::Queue<service::FaultReport>& fault_out_;
  std::optional<service::CatheterTips> catheters_;
  service::CatheterMoment moment_;
  service::Outbox places_;  ///< of tips that take long to find
  service::Outbox::Latest<service::CatheterMoment>& moment_out_;
  service::FaultWatch fault_watch_;
  service::LatestValue<dds::ActuationCommand> command_;
  std::atomic<bool> stop_requested_{false}, serving_{false}, in_cycle_{false}, ended_{false};
  std::atomic<std::uint8_t> emergency_{0};
  std::int64_t period_, start_ = 0;  ///< ns
  std::uint64_t stepped_ = 0;        ///< periods that the drives have gone
  dds::ActuationState state_;
  dds::HalStatus status_;
  dds::TipPoses tips_;
  SnapLog snaps_;
};

void run(const service::Setup& setup, service::StopSignal& stop) {
  if (setup.deployment.clock == config::ClockMode::kLockStep) {
    runLockStep(setup, stop);
  } else {
    RealTime(setup).run(stop);
  }
}

}  // namespace

int main(int argc, char** argv) {
  return service::runService(argc, argv, "sim", "The simulated robot: the same topics, states and gate as the HAL.",
                             run);
}
