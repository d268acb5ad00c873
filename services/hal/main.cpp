// SPDX-License-Identifier: Apache-2.0
/** @file tandem-hal: real drives and encoders on CAN, behind the topics that control knows. */
#include <spdlog/spdlog.h>

#include <atomic>
#include <mutex>

#include "hal/can/link.h"
#include "services/common/latest_value.h"
#include "services/common/outbox.h"
#include "services/common/periodic_loop.h"
#include "services/common/spsc_queue.h"
#include "services/hal/bus_claim.h"
#include "services/hal/bus_setup.h"
#include "services/hal/hal_core.h"
#include "services/hal/hal_events.h"
#include "services/setup/actuation.h"
#include "services/setup/clock_desk.h"
#include "services/setup/fault_log.h"

using namespace tandem;

namespace {

/// A CAN controller off its bus comes back by an operator's wish only; the wish is what clears a fault.
void restartBus(const hal::BusConfig& bus) {
  constexpr std::string_view kCan = "can:";
  if (!bus.address.starts_with(kCan))
    return;
  try {
    hal::can::restartLink(bus.address.substr(kCan.size()));
    spdlog::warn("bus {}: restarted", bus.name);
  } catch (const std::exception& error) {
    spdlog::error("bus {}: cannot be restarted: {}", bus.name, error.what());
  }
}

/** A periodic thread that sees the buses and never DDS; publishers that see DDS and never the buses. */
class Service {
 public:
  Service(const service::Setup& setup, const hal::HardwareConfig& hardware, service::HalCore& core)
      : setup_(setup),
        hardware_(hardware),
        core_(core),
        loop_(hardware.period),
        status_every_(
            std::max<std::uint64_t>(1, static_cast<std::uint64_t>(setup.deployment.status_period / hardware.period))),
        bus_(service::busOptions(setup.deployment, setup.name)),
        states_(bus_.writer(dds::kActuationState)),
        statuses_(bus_.writer(dds::kHalStatus)),
        replies_(bus_.writer(dds::kHalReply)),
        diagnostics_(bus_, setup.name, setup.robot.name),
        state_out_(outbox_.latest<dds::ActuationState>([this](const auto& m) { states_.write(m); })),
        beats_out_(outbox_.latest<service::LoopStatistics>([this](const auto& m) { setup_.heartbeat->beat(m); })),
        status_out_(publisher_.latest<dds::HalStatus>([this](const auto& m) {
          statuses_.write(m);
          diagnose(m);
        })),
        answers_out_(
            publisher_.queue<service::HalAnswer>(64, [this](const auto& m) { replies_.write(service::replyOf(m)); })),
        faults_out_(
            publisher_.queue<service::FaultReport>(64, [this](const auto& m) { service::logFault(setup_.robot, m); })),
        events_out_(publisher_.queue<hal::HardwareEvent>(256, [this](const auto& m) { tell(m); })),
        restarts_out_(
            publisher_.queue<int>(8, [this](int b) { restartBus(hardware_.buses[static_cast<std::size_t>(b)]); })) {}

  void run(service::StopSignal& stop) {
    outbox_.start();
    publisher_.start();
    auto commands = bus_.reader(dds::kActuationCommand, [this](const dds::ActuationCommand& m) { command_.store(m); });
    auto requests = bus_.reader(dds::kHalRequest, [this](const dds::HalRequest& m) {
      const std::lock_guard lock(order_mutex_);  // DDS threads; the periodic one takes no lock
      orders_.push({m.client, m.request, m.kind, m.arm});
    });
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
    spdlog::info("ready: hardware {}, {} axes on {} buses, period {} s", hardware_.name, hardware_.axes.size(),
                 hardware_.buses.size(), loop_.period());
    core_.start(service::monotonicNow());
    loop_.run([&](const service::Tick& tick) {
      cycle(tick);
      return goOn(stop.requested(), tick.now);
    });
    outbox_.stop();
    publisher_.stop();
  }

 private:
  /// Leaving means a stop of all arms first, and no torque; the drives' own watchdogs are for what dies.
  bool goOn(bool asked, std::int64_t now) noexcept {
    constexpr std::int64_t kPatience = 2'000'000'000;  // ns
    if (asked && leaving_since_ == 0) {
      leaving_since_ = now;
      core_.onStop();
    }
    return leaving_since_ == 0 || (!core_.robot().off() && now - leaving_since_ < kPatience);
  }

  void cycle(const service::Tick& tick) noexcept {
    if (command_.take(command_message_))
      core_.onCommand(command_message_, tick.now);
    if (stop_requested_.exchange(false, std::memory_order_relaxed))
      core_.onStop();
    if (const std::uint8_t told = emergency_.exchange(0, std::memory_order_relaxed); told != 0)
      core_.onEmergencyStop(told == service::kPressedReport, tick.now);
    service::HalOrder order;
    while (orders_.pop(order))
      answers_out_.post(core_.onOrder(order, tick.now));
    left_out_ += tick.skipped;
    core_.step(tick.now);
    core_.state(tick.now, state_);
    state_out_.post(state_);
    beats_out_.post(loop_.statistics());
    hal::HardwareEvent event;
    while (core_.nextEvent(event))
      events_out_.post(event);
    for (int k = 0; k < core_.armCount(); ++k) {
      if (fault_watch_.fresh(k, core_.faultRecord(k)))
        faults_out_.post({k, core_.faultRecord(k)});
    }
    for (int b = 0; b < core_.robot().busCount(); ++b) {
      if (core_.takeRestart(b))
        restarts_out_.post(b);
    }
    if (tick.cycle % status_every_ != 0)
      return;
    core_.status(tick.now, status_);
    service::writeLoop(loop_, status_);
    status_.left_out = left_out_;
    status_out_.post(status_);
  }

  void tell(const hal::HardwareEvent& event) {
    const std::string text = service::describe(event, core_.robot());
    if (service::isProblem(event)) {
      spdlog::error("{}", text);
      last_problem_ = text;
    } else {
      spdlog::info("{}", text);
    }
  }

  void diagnose(const dds::HalStatus& status) {
    service::diagnose(diagnostics_, setup_.robot, status,
                      {{"bus_load", fmt::format("{:.3f}", status.bus_load)}, {"last_problem", last_problem_}});
  }

  const service::Setup& setup_;
  const hal::HardwareConfig& hardware_;
  service::HalCore& core_;
  service::PeriodicLoop loop_;
  std::uint64_t status_every_;
  dds::Bus bus_;
  dds::Writer<dds::ActuationState> states_;
  dds::Writer<dds::HalStatus> statuses_;
  dds::Writer<dds::Reply> replies_;
  std::string last_problem_ = "none";  ///< publisher thread
  service::Diagnostics diagnostics_;
  service::Outbox outbox_;     ///< what control waits for
  service::Outbox publisher_;  ///< what people wait for
  service::Outbox::Latest<dds::ActuationState>& state_out_;
  service::Outbox::Latest<service::LoopStatistics>& beats_out_;
  service::Outbox::Latest<dds::HalStatus>& status_out_;
  service::Outbox::Queue<service::HalAnswer>& answers_out_;
  service::Outbox::Queue<service::FaultReport>& faults_out_;
  service::FaultWatch fault_watch_;
  service::Outbox::Queue<hal::HardwareEvent>& events_out_;
  service::Outbox::Queue<int>& restarts_out_;
  service::LatestValue<dds::ActuationCommand> command_;
  std::mutex order_mutex_;
  service::SpscQueue<service::HalOrder> orders_{64};
  std::atomic<bool> stop_requested_{false};
  std::atomic<std::uint8_t> emergency_{0};
  std::int64_t leaving_since_ = 0;
  std::uint64_t left_out_ = 0;  ///< periods without a cycle: drives have held their last target
  dds::ActuationCommand command_message_;
  dds::ActuationState state_;
  dds::HalStatus status_;
};

void run(const service::Setup& setup, service::StopSignal& stop) {
  constexpr double kPatience = 15.0;  // s
  const hal::HardwareConfig hardware = service::loadHardwareOf(setup);
  const auto buses = service::openBuses(hardware, stop, kPatience);
  if (buses.empty())
    return;
  std::vector<hal::can::Bus*> open;
  for (const auto& bus : buses)
    open.push_back(bus.get());
  const auto locks = service::lockBuses(hardware);
  service::HalCore core(setup, hardware, open);
  if (service::listenFirst(core, stop))
    Service(setup, hardware, core).run(stop);
}

}  // namespace

int main(int argc, char** argv) {
  return service::runService(argc, argv, "hal", "Drives and encoders on CAN: watches, gates and moves them.", run);
}
