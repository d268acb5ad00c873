// SPDX-License-Identifier: Apache-2.0
/** @file tandem-hal: real drives and encoders on CAN, behind the actuation topics. */
#include <spdlog/spdlog.h>

#include <algorithm>
#include <mutex>
#include <string_view>

#include "hal/can/link.h"
#include "services/hal/bus_claim.h"
#include "services/hal/bus_setup.h"
#include "services/hal/hal_core.h"
#include "services/hal/hal_events.h"
#include "services/hal/homing_log.h"
#include "services/hal/position_keeper.h"
#include "services/runtime/drive_shell.h"
#include "services/runtime/spsc_queue.h"

using namespace tandem;

namespace {

/// Restarts a CAN controller that is bus-off, only after an operator's request to clear the fault.
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

/** Periodic thread with access to the buses but not to DDS; publisher threads with access to DDS but not to the buses.
 */
class Service {
 public:
  Service(const runtime::Setup& setup, const hal::HardwareConfig& hardware, hal_service::HalCore& core)
      : hardware_(hardware),
        core_(core),
        positions_(hardware, hal_service::positionFile(hardware), core),
        homing_log_(setup.robot),
        shell_(setup, hardware.period, [this](const auto& m) { return details(m); }),
        replies_(shell_.bus().writer(dds::kHalReply)),
        answers_out_(shell_.publisher().queue<hal_service::HalAnswer>(
            64,
            [this](const auto& m) {
              replies_.write(hal_service::replyOf(m));
              log(homing_log_.answered(m, shell_.bus().identityOf(m.client), runtime::monotonicNow()));
            })),
        events_out_(shell_.publisher().queue<hal::HardwareEvent>(256, [this](const auto& m) { log(m); })),
        restarts_out_(shell_.publisher().queue<int>(8, [this](int b) {
          restartBus(hardware_.buses[static_cast<std::size_t>(b)]);
        })) {}

  void run(const runtime::StopSignal& stop) {
    shell_.refuseMismatches([this](const dds::Reply& reply) { replies_.write(reply); });
    const auto requests = shell_.bus().reader(dds::kHalRequest, [this](const dds::HalRequest& m) {
      const std::lock_guard lock(request_mutex_);  // DDS threads; the periodic one takes no lock
      requests_.push({m.client, m.request, m.kind, m.arm, m.joint, m.position});
    });
    const std::string what =
        fmt::format("hardware {}, {} axes on {} buses", hardware_.name, hardware_.axes.size(), hardware_.buses.size());
    shell_.run(what, [&](const runtime::Tick& tick) {
      cycle(tick);
      return keepsRunning(stop.requested(), tick.now);
    });
  }

 private:
  /// Before the process ends, it stops all arms and removes torque; the drives' own watchdogs cover a process that is
  /// killed.
  bool keepsRunning(bool asked, std::int64_t now) noexcept {
    constexpr std::int64_t kTimeout = 2'000'000'000;  // ns
    if (asked && leaving_since_ == 0) {
      leaving_since_ = now;
      core_.onStop();
    }
    return leaving_since_ == 0 || (!core_.robot().off() && now - leaving_since_ < kTimeout);
  }

  void cycle(const runtime::Tick& tick) noexcept {
    if (tick.cycle == 1)
      core_.start(tick.now);
    shell_.take(core_, tick.now);
    hal_service::ParsedHalRequest request;
    while (requests_.pop(request))
      answers_out_.post(core_.onRequest(request, tick.now));
    core_.step(tick.now);
    positions_.offer(core_, tick.now);
    shell_.show(core_, tick);
    hal::HardwareEvent event;
    while (core_.nextEvent(event))
      events_out_.post(event);
    for (int b = 0; b < core_.robot().busCount(); ++b) {
      if (core_.takeRestart(b))
        restarts_out_.post(b);
    }
  }

  void log(const hal::HardwareEvent& event) {
    const std::string text = hal_service::describe(event, core_.robot());
    failures_.note(event, text);
    if (hal_service::isProblem(event)) {
      spdlog::error("{}", text);
      last_problem_ = text;
    } else if (hal_service::isRemarkable(event, core_.robot())) {
      spdlog::warn("{}", text);
    } else {
      spdlog::info("{}", text);
    }
  }

  void log(const hal_service::HomingLog::Line& line) {
    if (!line.text.empty())
      spdlog::log(line.refused ? spdlog::level::warn : spdlog::level::info, "{}", line.text);
  }

  /// Publisher thread.
  runtime::Details details(const dds::HalStatus& status) {
    log(homing_log_.look(runtime::monotonicNow()));
    const double* const success = status.bus_success.data();
    const double worst = status.bus_count > 0 ? *std::min_element(success, success + status.bus_count) : 1.0;
    runtime::Details details = failures_.details(hardware_, status);
    details.insert(details.end(), {{"bus_load", fmt::format("{:.3f}", status.bus_load)},
                                   {"bus_success", fmt::format("{:.2f}", worst)},
                                   {"lost_protections", hal_service::describeLost(hardware_, status)},
                                   {"last_problem", last_problem_}});
    return details;
  }

  const hal::HardwareConfig& hardware_;
  hal_service::HalCore& core_;
  hal_service::PositionKeeper positions_;
  std::string last_problem_ = "none";     ///< publisher thread
  hal_service::DeviceFailures failures_;  ///< publisher thread
  hal_service::HomingLog homing_log_;     ///< publisher thread
  runtime::DriveShell shell_;
  dds::Writer<dds::Reply> replies_;
  runtime::Outbox::Queue<hal_service::HalAnswer>& answers_out_;
  runtime::Outbox::Queue<hal::HardwareEvent>& events_out_;
  runtime::Outbox::Queue<int>& restarts_out_;
  std::mutex request_mutex_;
  runtime::SpscQueue<hal_service::ParsedHalRequest> requests_{64};
  std::int64_t leaving_since_ = 0;
};

void run(const runtime::Setup& setup, runtime::StopSignal& stop) {
  constexpr double kTimeout = 15.0;  // s
  const hal::HardwareConfig hardware = hal_service::loadHardwareOf(setup);
  auto buses = hal_service::openBuses(hardware, setup.deployment.budgets, stop, kTimeout);
  if (buses.empty())
    return;
  const auto locks = hal_service::lockBuses(hardware);
  hal_service::HalCore core(setup, hardware, std::move(buses));
  if (hal_service::waitForSilentBus(core, stop))
    Service(setup, hardware, core).run(stop);
}

}  // namespace

int main(int argc, char** argv) {
  return runtime::runService(argc, argv, "hal", "Controls drives and encoders on CAN, and checks every setpoint.", run);
}
