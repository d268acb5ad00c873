// SPDX-License-Identifier: Apache-2.0
/** @file tandem-control: redundancy resolution of the cooperating arms at a fixed rate. */
#include <spdlog/spdlog.h>

#include <atomic>
#include <mutex>

#include "services/control/service.h"
#include "services/runtime/latest_value.h"
#include "services/runtime/mailbox.h"
#include "services/runtime/realtime_shell.h"
#include "services/runtime/spsc_queue.h"

using namespace tandem;
using service::Service;

namespace {

/** Lock-step: one worker thread answers states and references as they come. */
class LockStep {
 public:
  explicit LockStep(Service& service) : service_(service) {}

  void run(service::StopSignal& stop) {
    const auto put = [this](const auto& message) { loop_.put(message); };
    service_.listen(
        put, put, put, put, [this] { loop_.put(dds::Stop{}); }, put, put, [this] { loop_.put(dds::Mismatch{}); });
    service_.clearance.start();
    spdlog::info("ready: lock-step, period {} s of simulated time", service_.setup.deployment.control_period);
    loop_.run(service_.setup, stop, kIdle, [this](const auto& message) {
      const bool tell = take(message);
      const std::int64_t now = service::monotonicNow();
      const bool advance = service_.core.readyToAdvance();
      if (advance || tell || now - last_told_ > static_cast<std::int64_t>(1e9 * kIdle))
        speak(now, advance);
    });
    service_.clearance.stop();
  }

 private:
  static constexpr double kIdle = 0.02;  // s

  // Each returns whether the others should learn of it at once.
  bool take(std::monostate) { return true; }
  bool take(const dds::ActuationState& message) {
    state_ = message;
    service_.core.onState(message);
    return false;
  }
  bool take(const dds::TipPoses& message) {
    service_.core.onTips(message);
    return false;
  }
  bool take(const dds::PlanningReference& message) {
    service_.core.onReference(message);
    return false;
  }
  bool take(const operation::ControlOrder& order) {
    const std::int64_t now = service::monotonicNow();
    const operation::OrderReply reply = service_.core.order(order, now);
    service_.holder = service_.core.leaseHolder(now);
    service_.answer(reply);
    return order.kind != dds::ControlKind::kKeepLease;
  }
  bool take(const dds::Stop&) {
    service_.core.stop();
    return true;
  }
  bool take(const dds::Mismatch&) {
    service_.core.onMismatch(service::monotonicNow());
    return true;
  }
  bool take(const dds::TeleopInput& message) {
    service_.core.onInput(message, service::monotonicNow());
    return false;
  }
  bool take(const operation::CrtkOrder& order) {
    service_.crtk_command_handler.report(service_.core.crtk(order, service::monotonicNow()));
    return true;
  }

  void speak(std::int64_t now, bool advance) {
    service_.core.cycle(now, advance, output_);
    // The status first: whoever sees the state that follows from the command has it already.
    service_.statuses.write(output_.status);
    if (advance)
      service_.limits.write(output_.limits);
    if (advance || service_.core.drivesPending())
      service_.commands.write(output_.command);
    watch_.look(service_.core, service_.robot.armCount(),
                [this](const auto& report) { service::logFault(service_.setup.robot, report); });
    if (!advance)
      last_told_ = now;
    if (now - last_crtk_ > static_cast<std::int64_t>(1e9 * service_.setup.deployment.status_period)) {
      service_.fillMoment(now, state_, output_, snapshot_);
      service_.publish(snapshot_);
      service_.clearance.post(state_);
      last_crtk_ = now;
    }
  }

  Service& service_;
  service::EventLoop<dds::ActuationState,
                     dds::TipPoses,
                     dds::PlanningReference,
                     operation::ControlOrder,
                     dds::Stop,
                     dds::Mismatch,
                     dds::TeleopInput,
                     operation::CrtkOrder>
      loop_;
  operation::CycleOutput output_;
  dds::ActuationState state_;
  service::Snapshot snapshot_;
  std::int64_t last_told_ = 0, last_crtk_ = 0;
  service::FaultWatch watch_;
};

/** Real time: a periodic thread that never sees DDS. */
class RealTime {
 public:
  explicit RealTime(Service& service)
      : service_(service),
        shell_(service.setup, service.setup.deployment.control_period),
        commands_(shell_.outbox().latest<dds::ActuationCommand>([&](const auto& m) { service_.commands.write(m); })),
        statuses_(shell_.outbox().latest<dds::ControlStatus>([&](const auto& m) { service_.statuses.write(m); })),
        limits_(shell_.outbox().latest<dds::ActuationLimits>([&](const auto& m) { service_.limits.write(m); })),
        snapshots_(shell_.publisher().latest<service::Snapshot>([&](const auto& m) { service_.publish(m); })),
        outcomes_(shell_.publisher().queue<operation::CrtkOutcome>(
            256,
            [&](const auto& m) { service_.crtk_command_handler.report(m); })),
        answers_(shell_.publisher().queue<operation::OrderReply>(256, [&](const auto& m) { service_.answer(m); })),
        idles_(shell_.publisher().queue<service::IdleReport>(32, [&](const auto& m) { service_.logIdle(m); })) {}

  void run(service::StopSignal& stop) {
    service_.clearance.start();
    if (service_.frames != nullptr)
      service_.frames->start();
    service_.listen([this](const dds::ActuationState& m) { states_.store(m); },
                    [this](const dds::TipPoses& m) { tips_.store(m); },
                    [this](const dds::PlanningReference& m) { references_.store(m); },
                    [this](const operation::ControlOrder& m) { putOrder(m); }, [this] { stop_requested_ = true; },
                    [this](const dds::TeleopInput& m) { putInput(m); },
                    [this](const operation::CrtkOrder& m) { putCrtk(m); }, [this] { mismatch_ = true; });
    shell_.run("robot " + service_.setup.robot.name, [&](const service::Tick& tick) {
      cycle(tick);
      return !stop.requested();
    });
    service_.clearance.stop();
    if (service_.frames != nullptr)
      service_.frames->stop();
  }

 private:
  void putOrder(const operation::ControlOrder& order) {
    const std::lock_guard lock(order_mutex_);  // several DDS threads; the periodic one takes no lock
    if (orders_.push(order))
      return;
    operation::OrderReply reply;
    reply.client = order.client;
    reply.request = order.request;
    reply.refusal.reason = operation::Reason::kTooFast;
    reply.retired = order.tracker;
    service_.answer(reply);
  }

  /// Inputs of others than the commander must not overtake the commander's.
  void putInput(const dds::TeleopInput& input) {
    (input.client == service_.holder.load(std::memory_order_relaxed) ? inputs_ : other_inputs_).store(input);
  }

  void putCrtk(const operation::CrtkOrder& order) {
    const std::lock_guard lock(order_mutex_);
    if (crtk_orders_.push(order))
      return;
    operation::CrtkOutcome outcome;
    outcome.verb = order.verb;
    outcome.group = order.group;
    service_.crtk_command_handler.report(outcome.refuse("%s", idl::name(operation::Reason::kTooFast).data()));
  }

  void takeOperators(std::int64_t now) noexcept {
    if (inputs_.take(input_))
      service_.core.onInput(input_, now);
    if (other_inputs_.take(input_))
      service_.core.onInput(input_, now);
    operation::CrtkOrder order;
    while (crtk_orders_.pop(order))
      outcomes_.post(service_.core.crtk(order, now));
  }

  static void tellTiming(const service::LoopStatistics& s, dds::ControlStatus& status) noexcept {
    status.cycle_time = s.execution_last;
    status.cycle_time_max = s.execution_max;
    status.jitter_max = s.lateness_max;
    status.cycles = s.cycles;
    status.overruns = s.overruns;
  }

  void cycle(const service::Tick& tick) noexcept {
    if (states_.take())
      service_.core.onState(states_.value(), states_.arrivals());
    if (tips_.take(measured_))
      service_.core.onTips(measured_);
    if (references_.take())
      service_.core.onReference(references_.value(), references_.arrivals());
    if (stop_requested_.exchange(false, std::memory_order_relaxed))
      service_.core.stop();
    if (mismatch_.exchange(false, std::memory_order_relaxed))
      service_.core.onMismatch(tick.now);
    operation::ControlOrder order;
    while (orders_.pop(order)) {
      const operation::OrderReply reply = service_.core.order(order, tick.now);
      service_.holder.store(service_.core.leaseHolder(tick.now), std::memory_order_relaxed);
      answers_.post(reply);
    }
    takeOperators(tick.now);
    const service::LoopStatistics& s = shell_.loop().statistics();
    service_.core.cycle(tick.now, false, output_);
    tellTiming(s, output_.status);
    service_.holder.store(output_.status.lease_holder, std::memory_order_relaxed);
    for (int i = 0; i < output_.endings.count; ++i)
      outcomes_.post(output_.endings.outcome[static_cast<std::size_t>(i)]);
    service_.tellIdle(output_, [this](const service::IdleReport& report) { idles_.post(report); });
    commands_.post(output_.command);
    statuses_.post(output_.status);
    limits_.post(output_.limits);
    shell_.close(service_.core, service_.robot.armCount());
    if (shell_.isTold(tick)) {
      service_.fillMoment(tick.now, states_.value(), output_, snapshot_);
      snapshots_.post(snapshot_);
      service_.clearance.post(states_.value());
    }
  }

  Service& service_;
  service::RealtimeShell shell_;
  service::Outbox::Latest<dds::ActuationCommand>& commands_;
  service::Outbox::Latest<dds::ControlStatus>& statuses_;
  service::Outbox::Latest<dds::ActuationLimits>& limits_;
  service::Outbox::Latest<service::Snapshot>& snapshots_;
  service::Outbox::Queue<operation::CrtkOutcome>& outcomes_;
  service::Outbox::Queue<operation::OrderReply>& answers_;
  service::Outbox::Queue<service::IdleReport>& idles_;
  service::LatestSample<dds::ActuationState> states_;
  service::LatestValue<dds::TipPoses> tips_;
  service::LatestSample<dds::PlanningReference> references_;
  std::mutex order_mutex_;
  service::SpscQueue<operation::ControlOrder> orders_{64};
  service::SpscQueue<operation::CrtkOrder> crtk_orders_{256};
  service::LatestValue<dds::TeleopInput> inputs_, other_inputs_;
  std::atomic<bool> stop_requested_{false}, mismatch_{false};
  dds::TipPoses measured_;
  dds::TeleopInput input_;
  service::Snapshot snapshot_;
  operation::CycleOutput output_;
};

void run(const service::Setup& setup, service::StopSignal& stop) {
  Service service(setup);
  if (setup.deployment.clock == config::ClockMode::kLockStep) {
    LockStep lock_step(service);
    lock_step.run(stop);
    service.readers.clear();
  } else {
    RealTime real_time(service);
    real_time.run(stop);
    service.readers.clear();
  }
}

}  // namespace

int main(int argc, char** argv) {
  return service::runService(
      argc, argv, "control",
      "Resolves the redundancy of the cooperating arms at a fixed rate and commands their joints.", run);
}
