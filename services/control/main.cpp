// SPDX-License-Identifier: Apache-2.0
/** @file tandem-control: redundancy resolution of the cooperating arms at a fixed rate. */
#include <spdlog/spdlog.h>

#include <atomic>
#include <mutex>

#include "services/control/service.h"
#include "services/runtime/cycle_log.h"
#include "services/runtime/latest_value.h"
#include "services/runtime/mailbox.h"
#include "services/runtime/realtime_shell.h"
#include "services/runtime/spsc_queue.h"

using namespace tandem;
using control_service::Service;

namespace {

/** Lock-step: one worker thread processes states and references in the order of arrival. */
class LockStep {
 public:
  explicit LockStep(Service& service) : service_(service) {}

  void run(runtime::StopSignal& stop) {
    const auto put = [this](const auto& message) { loop_.put(message); };
    service_.listen(
        put, put, put, put, [this] { loop_.put(dds::Stop{}); }, put, put, [this] { loop_.put(dds::Mismatch{}); });
    service_.clearance.start();
    spdlog::info("ready: lock-step, period {} s of simulated time", service_.setup.deployment.control_period);
    loop_.run(service_.setup, stop, kIdle, [this](const auto& message) {
      const bool publish_now = take(message);
      const std::int64_t now = runtime::monotonicNow();
      const bool advance = service_.core.readyToAdvance();
      if (advance || publish_now || now - last_status_ > static_cast<std::int64_t>(1e9 * kIdle))
        publish(now, advance);
    });
    service_.clearance.stop();
  }

 private:
  static constexpr double kIdle = 0.02;  // s

  // Each returns whether the status must be published at once.
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
  bool take(const operation::ParsedControlRequest& request) {
    const std::int64_t now = runtime::monotonicNow();
    const operation::ControlReply reply = service_.core.onRequest(request, now);
    service_.owner = service_.core.leaseOwner(now);
    service_.answer(reply);
    return request.kind != dds::ControlKind::kKeepLease;
  }
  bool take(const dds::Stop&) {
    service_.core.stop();
    return true;
  }
  bool take(const dds::Mismatch&) {
    service_.core.onMismatch(runtime::monotonicNow());
    return true;
  }
  bool take(const dds::TeleopInput& message) {
    service_.core.onInput(message, runtime::monotonicNow());
    return false;
  }
  bool take(const operation::CrtkRequest& request) {
    service_.crtk_command_handler.report(service_.core.crtk(request, runtime::monotonicNow()));
    return true;
  }

  void publish(std::int64_t now, bool advance) {
    service_.core.cycle(now, advance, output_);
    // The status first: a receiver of the state that results from the command has then received the status.
    service_.statuses.write(output_.status);
    if (advance)
      service_.limits.write(output_.limits);
    if (advance || service_.core.drivesPending())
      service_.commands.write(output_.command);
    watch_.look(service_.core, service_.robot.armCount(),
                [this](const auto& report) { runtime::logFault(service_.setup.robot, report); });
    if (!advance)
      last_status_ = now;
    if (now - last_crtk_ > static_cast<std::int64_t>(1e9 * service_.setup.deployment.status_period)) {
      service_.fillSnapshot(now, state_, output_, snapshot_);
      service_.publish(snapshot_);
      service_.clearance.post(state_);
      last_crtk_ = now;
    }
  }

  Service& service_;
  runtime::EventLoop<dds::ActuationState,
                     dds::TipPoses,
                     dds::PlanningReference,
                     operation::ParsedControlRequest,
                     dds::Stop,
                     dds::Mismatch,
                     dds::TeleopInput,
                     operation::CrtkRequest>
      loop_;
  operation::CycleOutput output_;
  dds::ActuationState state_;
  control_service::Snapshot snapshot_;
  std::int64_t last_status_ = 0, last_crtk_ = 0;
  runtime::FaultWatch watch_;
};

/** Real time: a periodic thread without DDS calls. */
class RealTime {
 public:
  explicit RealTime(Service& service)
      : service_(service),
        shell_(service.setup, service.setup.deployment.control_period),
        cycle_log_(service.setup),
        commands_(shell_.outbox().latest<dds::ActuationCommand>([&](const auto& m) { service_.commands.write(m); })),
        statuses_(shell_.outbox().latest<dds::ControlStatus>([&](const auto& m) { service_.statuses.write(m); })),
        limits_(shell_.outbox().latest<dds::ActuationLimits>([&](const auto& m) { service_.limits.write(m); })),
        snapshots_(shell_.publisher().latest<control_service::Snapshot>([&](const auto& m) { service_.publish(m); })),
        outcomes_(shell_.publisher().queue<operation::CrtkOutcome>(
            256,
            [&](const auto& m) { service_.crtk_command_handler.report(m); })),
        answers_(shell_.publisher().queue<operation::ControlReply>(256, [&](const auto& m) { service_.answer(m); })),
        idles_(shell_.publisher().queue<control_service::IdleReport>(32, [&](const auto& m) { service_.logIdle(m); })) {
  }

  void run(runtime::StopSignal& stop) {
    service_.clearance.start();
    if (service_.object_loop != nullptr)
      service_.object_loop->start();
    service_.listen([this](const dds::ActuationState& m) { states_.store(m); },
                    [this](const dds::TipPoses& m) { tips_.store(m); },
                    [this](const dds::PlanningReference& m) { references_.store(m); },
                    [this](const operation::ParsedControlRequest& m) { putRequest(m); },
                    [this] { stop_requested_ = true; }, [this](const dds::TeleopInput& m) { putInput(m); },
                    [this](const operation::CrtkRequest& m) { putCrtk(m); }, [this] { mismatch_ = true; });
    shell_.run("robot " + service_.setup.robot.name, [&](const runtime::Tick& tick) {
      cycle(tick);
      return !stop.requested();
    });
    service_.clearance.stop();
    if (service_.object_loop != nullptr)
      service_.object_loop->stop();
  }

 private:
  void putRequest(const operation::ParsedControlRequest& request) {
    const std::lock_guard lock(request_mutex_);  // several DDS threads; the periodic one takes no lock
    if (requests_.push(request))
      return;
    operation::ControlReply reply;
    reply.client = request.client;
    reply.request = request.request;
    reply.refusal.reason = operation::Reason::kTooFast;
    reply.retired = request.tracker;
    service_.answer(reply);
  }

  /// Inputs of other clients must not replace those of the lease owner.
  void putInput(const dds::TeleopInput& input) {
    (input.client == service_.owner.load(std::memory_order_relaxed) ? inputs_ : other_inputs_).store(input);
  }

  void putCrtk(const operation::CrtkRequest& request) {
    const std::lock_guard lock(request_mutex_);
    if (crtk_requests_.push(request))
      return;
    operation::CrtkOutcome outcome;
    outcome.verb = request.verb;
    outcome.group = request.group;
    service_.crtk_command_handler.report(outcome.refuse("%s", idl::name(operation::Reason::kTooFast).data()));
  }

  void takeOperators(std::int64_t now) noexcept {
    cycle_.input_taken = inputs_.take(input_);
    cycle_.input = input_;
    if (cycle_.input_taken)
      service_.core.onInput(input_, now);
    if (other_inputs_.take(input_))
      service_.core.onInput(input_, now);
    operation::CrtkRequest request;
    while (crtk_requests_.pop(request))
      outcomes_.post(service_.core.crtk(request, now));
  }

  static void fillTiming(const runtime::LoopStatistics& s, dds::ControlStatus& status) noexcept {
    status.cycle_time = s.execution_last;
    status.cycle_time_max = s.execution_max;
    status.jitter_max = s.lateness_max;
    status.cycles = s.cycles;
    status.overruns = s.overruns;
  }

  void cycle(const runtime::Tick& tick) noexcept {
    cycle_.state_taken = states_.take();
    if (cycle_.state_taken)
      service_.core.onState(states_.value(), states_.arrivals());
    if (tips_.take(measured_))
      service_.core.onTips(measured_);
    cycle_.reference_taken = references_.take();
    if (cycle_.reference_taken)
      service_.core.onReference(references_.value(), references_.arrivals());
    if (stop_requested_.exchange(false, std::memory_order_relaxed))
      service_.core.stop();
    if (mismatch_.exchange(false, std::memory_order_relaxed))
      service_.core.onMismatch(tick.now);
    operation::ParsedControlRequest request;
    cycle_.lease_client = 0;
    while (requests_.pop(request)) {
      const operation::ControlReply reply = service_.core.onRequest(request, tick.now);
      const std::uint64_t owner = service_.core.leaseOwner(tick.now);
      service_.owner.store(owner, std::memory_order_relaxed);
      if (owner == request.client && operation::isOfLease(operation::actionOf(request))) {
        cycle_.lease_client = request.client;
        cycle_.lease_answers = request.answers_control;
      }
      answers_.post(reply);
    }
    takeOperators(tick.now);
    const runtime::LoopStatistics& s = shell_.loop().statistics();
    service_.core.onClearance(service_.clearance.nearest());
    service_.core.cycle(tick.now, false, output_);
    fillTiming(s, output_.status);
    service_.owner.store(output_.status.lease_owner, std::memory_order_relaxed);
    for (int i = 0; i < output_.endings.count; ++i)
      outcomes_.post(output_.endings.outcome[static_cast<std::size_t>(i)]);
    service_.reportIdle(output_, [this](const control_service::IdleReport& report) { idles_.post(report); });
    commands_.post(output_.command);
    statuses_.post(output_.status);
    limits_.post(output_.limits);
    if (cycle_log_.on())
      logCycle(tick);
    shell_.close(service_.core, service_.robot.armCount());
    if (shell_.isStatusCycle(tick)) {
      service_.fillSnapshot(tick.now, states_.value(), output_, snapshot_);
      snapshots_.post(snapshot_);
      service_.clearance.post(states_.value());
    }
  }

  void logCycle(const runtime::Tick& tick) noexcept {
    cycle_.tick = tick;
    cycle_.state = states_.value();
    cycle_.reference = references_.value();
    cycle_.status = output_.status;
    cycle_.command = output_.command;
    cycle_log_.post(cycle_);
  }

  Service& service_;
  runtime::RealtimeShell shell_;
  runtime::CycleLog<runtime::ControlCycle> cycle_log_;
  runtime::Outbox::Latest<dds::ActuationCommand>& commands_;
  runtime::Outbox::Latest<dds::ControlStatus>& statuses_;
  runtime::Outbox::Latest<dds::ActuationLimits>& limits_;
  runtime::Outbox::Latest<control_service::Snapshot>& snapshots_;
  runtime::Outbox::Queue<operation::CrtkOutcome>& outcomes_;
  runtime::Outbox::Queue<operation::ControlReply>& answers_;
  runtime::Outbox::Queue<control_service::IdleReport>& idles_;
  runtime::LatestSample<dds::ActuationState> states_;
  runtime::LatestValue<dds::TipPoses> tips_;
  runtime::LatestSample<dds::PlanningReference> references_;
  std::mutex request_mutex_;
  runtime::SpscQueue<operation::ParsedControlRequest> requests_{64};
  runtime::SpscQueue<operation::CrtkRequest> crtk_requests_{256};
  runtime::LatestValue<dds::TeleopInput> inputs_, other_inputs_;
  std::atomic<bool> stop_requested_{false}, mismatch_{false};
  dds::TipPoses measured_;
  dds::TeleopInput input_;
  control_service::Snapshot snapshot_;
  operation::CycleOutput output_;
  runtime::ControlCycle cycle_;
};

void run(const runtime::Setup& setup, runtime::StopSignal& stop) {
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
  return runtime::runService(
      argc, argv, "control",
      "Resolves the redundancy of the cooperating arms at a fixed rate and commands their joints.", run);
}
