// SPDX-License-Identifier: Apache-2.0
/** @file tandem-control: redundancy resolution of the cooperating arms at a fixed rate. */
#include <spdlog/spdlog.h>

#include <atomic>
#include <variant>

#include "services/common/latest_value.h"
#include "services/common/mailbox.h"
#include "services/common/outbox.h"
#include "services/common/periodic_loop.h"
#include "services/common/spsc_queue.h"
#include "services/control/service.h"

using namespace tandem;
using service::Service;

namespace {

/** Lock-step: one worker thread answers states and references as they come. */
class LockStep {
 public:
  explicit LockStep(Service& service) : service_(service) {}

  void run(service::StopSignal& stop) {
    service_.listen([this](const dds::ActuationState& m) { mailbox_.put(m); },
                    [this](const dds::TipPoses& m) { mailbox_.put(m); },
                    [this](const dds::PlanningReference& m) { mailbox_.put(m); },
                    [this](const service::ControlOrder& m) { mailbox_.put(m); }, [this] { mailbox_.put(dds::Stop{}); },
                    [this](const dds::TeleopInput& m) { mailbox_.put(m); },
                    [this](const service::CrtkOrder& m) { mailbox_.put(m); });
    service_.clearance.start();
    spdlog::info("ready: lock-step, period {} s of simulated time", service_.setup.deployment.control_period);
    while (!stop.requested()) {
      const auto event = mailbox_.take(kIdle);
      service_.setup.heartbeat->beat();
      bool tell = !event;
      if (event)
        tell = std::visit([this](const auto& message) { return take(message); }, *event);
      const std::int64_t now = service::monotonicNow();
      const bool advance = service_.core.readyToAdvance();
      tell = tell || now - last_told_ > static_cast<std::int64_t>(1e9 * kIdle);
      if (advance || tell)
        speak(now, advance);
    }
  }

 private:
  static constexpr double kIdle = 0.02;  // s
  using Event = std::variant<dds::ActuationState,
                             dds::TipPoses,
                             dds::PlanningReference,
                             service::ControlOrder,
                             dds::Stop,
                             dds::TeleopInput,
                             service::CrtkOrder>;

  // Each returns whether the others should hear of it at once.
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
  bool take(const service::ControlOrder& order) {
    service_.answer(service_.core.order(order, service::monotonicNow()));
    return order.kind != dds::ControlKind::kKeepLease;
  }
  bool take(const dds::Stop&) {
    service_.core.stop();
    return true;
  }
  bool take(const dds::TeleopInput& message) {
    service_.core.onInput(message, service::monotonicNow());
    return false;
  }
  bool take(const service::CrtkOrder& order) {
    service_.crtk_desk.settle(service_.core.crtk(order, service::monotonicNow()));
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
    service_.tellFaults(
        fault_watch_, [this](const service::FaultReport& report) { service::logFault(service_.setup.robot, report); });
    if (!advance)
      last_told_ = now;
    if (now - last_crtk_ > static_cast<std::int64_t>(1e9 * service_.setup.deployment.status_period)) {
      service_.fillMoment(now, state_, output_, moment_);
      service_.publish(moment_);
      service_.clearance.post(state_);
      last_crtk_ = now;
    }
  }

  Service& service_;
  service::Mailbox<Event> mailbox_;
  service::CycleOutput output_;
  dds::ActuationState state_;
  service::Moment moment_;
  std::int64_t last_told_ = 0, last_crtk_ = 0;
  service::FaultWatch fault_watch_;
};

/** Real time: a periodic thread that never sees DDS. */
class RealTime {
 public:
  explicit RealTime(Service& service)
      : service_(service),
        loop_(service.setup.deployment.control_period),
        crtk_every_(std::max<std::uint64_t>(
            1,
            static_cast<std::uint64_t>(service.setup.deployment.status_period / loop_.period()))),
        commands_(outbox_.latest<dds::ActuationCommand>([&](const auto& m) { service_.commands.write(m); })),
        statuses_(outbox_.latest<dds::ControlStatus>([&](const auto& m) { service_.statuses.write(m); })),
        limits_(outbox_.latest<dds::ActuationLimits>([&](const auto& m) { service_.limits.write(m); })),
        beats_(outbox_.latest<service::LoopStatistics>([&](const auto& m) { service_.setup.heartbeat->beat(m); })),
        moments_(publisher_.latest<service::Moment>([&](const auto& m) { service_.publish(m); })),
        outcomes_(publisher_.queue<service::CrtkOutcome>(256, [&](const auto& m) { service_.crtk_desk.settle(m); })),
        answers_(publisher_.queue<service::OrderReply>(256, [&](const auto& m) { service_.answer(m); })),
        faults_(
            publisher_.queue<service::FaultReport>(64,
                                                   [&](const auto& m) { service::logFault(service_.setup.robot, m); })),
        idles_(publisher_.queue<service::IdleReport>(32, [&](const auto& m) { service_.tellIdle(m); })) {}

  void run(service::StopSignal& stop) {
    outbox_.start();
    publisher_.start();
    service_.clearance.start();
    if (service_.core.frames() != nullptr)
      service_.core.frames()->start();
    service_.listen(
        [this](const dds::ActuationState& m) { states_.store(m); }, [this](const dds::TipPoses& m) { tips_.store(m); },
        [this](const dds::PlanningReference& m) { references_.store(m); },
        [this](const service::ControlOrder& m) { putOrder(m); }, [this] { stop_requested_ = true; },
        [this](const dds::TeleopInput& m) { putInput(m); }, [this](const service::CrtkOrder& m) { putCrtk(m); });
    const config::Deployment& deployment = service_.setup.deployment;
    for (const std::string& refusal : service::enterRealtime(deployment.realtime_priority, deployment.lock_memory)) {
      spdlog::warn("{}", refusal);
    }
    spdlog::info("ready: period {} s", loop_.period());
    loop_.run([&](const service::Tick& tick) {
      cycle(tick);
      return !stop.requested();
    });
    outbox_.stop();
    publisher_.stop();
    service_.clearance.stop();
    if (service_.core.frames() != nullptr)
      service_.core.frames()->stop();
  }

 private:
  void putOrder(const service::ControlOrder& order) {
    const std::lock_guard lock(order_mutex_);  // several DDS threads; the periodic one takes no lock
    if (orders_.push(order))
      return;
    service::OrderReply reply;
    reply.client = order.client;
    reply.request = order.request;
    reply.code = dds::ReplyCode::kBusy;
    reply.retired = order.tracker;
    service_.answer(reply);
  }

  /// Inputs of others than the commander must not overtake the commander's.
  void putInput(const dds::TeleopInput& input) {
    (input.client == lease_holder_.load(std::memory_order_relaxed) ? inputs_ : other_inputs_).store(input);
  }

  void putCrtk(const service::CrtkOrder& order) {
    const std::lock_guard lock(order_mutex_);
    if (crtk_orders_.push(order))
      return;
    service::CrtkOutcome outcome;
    outcome.verb = order.verb;
    outcome.group = order.group;
    service_.crtk_desk.settle(outcome.refuse("comes faster than control takes it"));
  }

  void takeOperators(std::int64_t now) noexcept {
    if (inputs_.take(input_))
      service_.core.onInput(input_, now);
    if (other_inputs_.take(input_))
      service_.core.onInput(input_, now);
    service::CrtkOrder order;
    while (crtk_orders_.pop(order))
      outcomes_.post(service_.core.crtk(order, now));
  }

  void cycle(const service::Tick& tick) noexcept {
    if (states_.take(state_))
      service_.core.onState(state_);
    if (tips_.take(measured_))
      service_.core.onTips(measured_);
    if (references_.take(reference_))
      service_.core.onReference(reference_);
    if (stop_requested_.exchange(false, std::memory_order_relaxed))
      service_.core.stop();
    service::ControlOrder order;
    while (orders_.pop(order))
      answers_.post(service_.core.order(order, tick.now));
    takeOperators(tick.now);
    const service::LoopStatistics& s = loop_.statistics();
    service_.core.setTiming({s.execution_last, s.execution_max, s.lateness_max, s.cycles, s.overruns});
    service_.core.cycle(tick.now, false, output_);
    lease_holder_.store(output_.status.lease_holder, std::memory_order_relaxed);
    for (service::CrtkOutcome outcome; service_.core.takeEnded(outcome);)
      outcomes_.post(outcome);
    for (service::IdleReport report; service_.core.takeIdle(report);)
      idles_.post(report);
    commands_.post(output_.command);
    statuses_.post(output_.status);
    limits_.post(output_.limits);
    beats_.post(s);
    service_.tellFaults(fault_watch_, [this](const service::FaultReport& report) { faults_.post(report); });
    if (tick.cycle % crtk_every_ == 0) {
      service_.fillMoment(tick.now, state_, output_, moment_);
      moments_.post(moment_);
      service_.clearance.post(state_);
    }
  }

  Service& service_;
  service::PeriodicLoop loop_;
  std::uint64_t crtk_every_;
  service::Outbox outbox_;     ///< what the robot waits for
  service::Outbox publisher_;  ///< what people wait for: it computes shapes
  service::Outbox::Latest<dds::ActuationCommand>& commands_;
  service::Outbox::Latest<dds::ControlStatus>& statuses_;
  service::Outbox::Latest<dds::ActuationLimits>& limits_;
  service::Outbox::Latest<service::LoopStatistics>& beats_;
  service::Outbox::Latest<service::Moment>& moments_;
  service::Outbox::Queue<service::CrtkOutcome>& outcomes_;
  service::Outbox::Queue<service::OrderReply>& answers_;
  service::Outbox::Queue<service::FaultReport>& faults_;
  service::Outbox::Queue<service::IdleReport>& idles_;
  service::FaultWatch fault_watch_;
  service::LatestValue<dds::ActuationState> states_;
  service::LatestValue<dds::TipPoses> tips_;
  service::LatestValue<dds::PlanningReference> references_;
  std::mutex order_mutex_;
  service::SpscQueue<service::ControlOrder> orders_{64};
  service::SpscQueue<service::CrtkOrder> crtk_orders_{256};
  service::LatestValue<dds::TeleopInput> inputs_, other_inputs_;
  std::atomic<std::uint64_t> lease_holder_{0};
  std::atomic<bool> stop_requested_{false};
  dds::ActuationState state_;
  dds::TipPoses measured_;
  dds::PlanningReference reference_;
  dds::TeleopInput input_;
  service::Moment moment_;
  service::CycleOutput output_;
};

void run(const service::Setup& setup, service::StopSignal& stop) {
  Service service(setup);
  if (setup.deployment.clock == config::ClockMode::kLockStep) {
    LockStep lock_step(service);
    lock_step.run(stop);
    service.clearance.stop();
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
