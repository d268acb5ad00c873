// SPDX-License-Identifier: Apache-2.0
/** @file tandem-hal: real drives and encoders on CAN, behind the topics that control knows. */
#include <spdlog/spdlog.h>

#include <algorithm>
#include <mutex>
#include <string_view>

#include "hal/can/link.h"
#include "services/hal/bus_claim.h"
#include "services/hal/bus_setup.h"
#include "services/hal/hal_core.h"
#include "services/hal/hal_events.h"
#include "services/runtime/drive_shell.h"
#include "services/runtime/spsc_queue.h"

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
      : hardware_(hardware),
        core_(core),
        shell_(setup, hardware.period, [this](const auto& m) { return details(m); }),
        replies_(shell_.bus().writer(dds::kHalReply)),
        answers_out_(shell_.publisher().queue<service::HalAnswer>(
            64,
            [this](const auto& m) { replies_.write(service::replyOf(m)); })),
        events_out_(shell_.publisher().queue<hal::HardwareEvent>(256, [this](const auto& m) { tell(m); })),
        restarts_out_(shell_.publisher().queue<int>(8, [this](int b) {
          restartBus(hardware_.buses[static_cast<std::size_t>(b)]);
        })) {}

  void run(const service::StopSignal& stop) {
    const auto requests = shell_.bus().reader(dds::kHalRequest, [this](const dds::HalRequest& m) {
      const std::lock_guard lock(order_mutex_);  // DDS threads; the periodic one takes no lock
      orders_.push({m.client, m.request, m.kind, m.arm});
    });
    const std::string what =
        fmt::format("hardware {}, {} axes on {} buses", hardware_.name, hardware_.axes.size(), hardware_.buses.size());
    shell_.run(what, [&](const service::Tick& tick) {
      cycle(tick);
      return goOn(stop.requested(), tick.now);
    });
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
    if (tick.cycle == 1)
      core_.start(tick.now);
    shell_.take(core_, tick.now);
    service::HalOrder order;
    while (orders_.pop(order))
      answers_out_.post(core_.onOrder(order, tick.now));
    core_.step(tick.now);
    shell_.show(core_, tick);
    hal::HardwareEvent event;
    while (core_.nextEvent(event))
      events_out_.post(event);
    for (int b = 0; b < core_.robot().busCount(); ++b) {
      if (core_.takeRestart(b))
        restarts_out_.post(b);
    }
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

  service::Details details(const dds::HalStatus& status) const {
    const double* const success = status.bus_success.data();
    const double worst = status.bus_count > 0 ? *std::min_element(success, success + status.bus_count) : 1.0;
    return {{"bus_load", fmt::format("{:.3f}", status.bus_load)},
            {"bus_success", fmt::format("{:.2f}", worst)},
            {"last_problem", last_problem_}};
  }

  const hal::HardwareConfig& hardware_;
  service::HalCore& core_;
  std::string last_problem_ = "none";  ///< publisher thread
  service::DriveShell shell_;
  dds::Writer<dds::Reply> replies_;
  service::Outbox::Queue<service::HalAnswer>& answers_out_;
  service::Outbox::Queue<hal::HardwareEvent>& events_out_;
  service::Outbox::Queue<int>& restarts_out_;
  std::mutex order_mutex_;
  service::SpscQueue<service::HalOrder> orders_{64};
  std::int64_t leaving_since_ = 0;
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
