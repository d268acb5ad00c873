// SPDX-License-Identifier: Apache-2.0
/** @file tandem-sim: the simulated robot, in the HAL's place. */
#include <spdlog/spdlog.h>

#include <atomic>
#include <variant>

#include "services/common/latest_value.h"
#include "services/common/mailbox.h"
#include "services/common/outbox.h"
#include "services/common/periodic_loop.h"
#include "services/setup/actuation.h"
#include "services/sim/sim_core.h"

using namespace tandem;

namespace {

/** Lock-step: commands move the time. */
void runLockStep(const service::Setup& setup, service::StopSignal& stop) {
  using Event = std::variant<dds::ActuationCommand, dds::SimRequest, dds::Stop>;
  service::SimCore core(setup);
  service::Mailbox<Event> mailbox;
  dds::Bus bus(service::busOptions(setup.deployment, setup.name));
  auto states = bus.writer(dds::kActuationState);
  auto statuses = bus.writer(dds::kHalStatus);
  auto replies = bus.writer(dds::kSimReply);
  const auto put = [&](const auto& message) { mailbox.put(message); };
  service::Diagnostics diagnostics(bus, setup.name, setup.robot.name);
  auto commands = bus.reader(dds::kActuationCommand, put);
  auto requests = bus.reader(dds::kSimRequest, put);
  auto stops = bus.reader(dds::kStop, put);

  dds::ActuationState state;
  dds::HalStatus status;
  core.state(service::monotonicNow(), state);
  const auto publish = [&](bool fresh) {
    if (fresh)
      core.state(service::monotonicNow(), state);
    core.status(status);
    statuses.write(status);
    states.write(state);
    service::diagnose(diagnostics, status);
  };
  spdlog::info("ready: robot {}, lock-step", setup.robot.name);
  constexpr double kRepeat = 0.1;  // s: whoever came late hears the present state
  while (!stop.requested()) {
    const auto event = mailbox.take(kRepeat);
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
        state_out_(outbox_.latest<dds::ActuationState>([this](const auto& m) { states_.write(m); })),
        diagnostics_(bus_, setup.name, setup.robot.name),
        status_out_(outbox_.latest<dds::HalStatus>([this](const auto& m) {
          statuses_.write(m);
          service::diagnose(diagnostics_, m);
        })) {}

  void run(service::StopSignal& stop) {
    outbox_.start();
    auto commands = bus_.reader(dds::kActuationCommand, [this](const dds::ActuationCommand& m) { command_.store(m); });
    auto requests = bus_.reader(dds::kSimRequest, [this](const dds::SimRequest& m) { onRequest(m); });
    auto stops = bus_.reader(dds::kStop, [this](const dds::Stop& m) {
      spdlog::error("stop: {}", m.reason);
      stop_requested_ = true;
    });
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
  }

 private:
  /// Requests reset the robot or break an axis: rare, and they allocate. The periodic thread leaves the core alone
  /// while one is served.
  void onRequest(const dds::SimRequest& request) {
    serving_ = true;
    while (in_cycle_.load() && !ended_)
      std::this_thread::yield();
    const dds::Reply reply = core_.onRequest(request);
    serving_ = false;
    replies_.write(reply);
  }

  void cycle(const service::Tick& tick) noexcept {
    in_cycle_ = true;
    if (serving_) {  // this step is left out: simulated joints have time
      in_cycle_ = false;
      return;
    }
    dds::ActuationCommand command;
    if (command_.take(command))
      core_.onCommand(command, tick.now);
    if (stop_requested_.exchange(false))
      core_.onStop();
    core_.step(tick.now);
    core_.state(tick.now, state_);
    state_out_.post(state_);
    if (tick.cycle % status_every_ == 0) {
      core_.status(status_);
      const service::LoopStatistics& s = loop_.statistics();
      status_.period = loop_.period();
      status_.jitter_max = s.lateness_max;
      status_.cycles = s.cycles;
      status_.overruns = s.overruns;
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
  service::Outbox outbox_;
  service::Outbox::Latest<dds::ActuationState>& state_out_;
  service::Diagnostics diagnostics_;
  service::Outbox::Latest<dds::HalStatus>& status_out_;
  service::LatestValue<dds::ActuationCommand> command_;
  std::atomic<bool> stop_requested_{false}, serving_{false}, in_cycle_{false}, ended_{false};
  dds::ActuationState state_;
  dds::HalStatus status_;
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
