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
#include "services/control/clearance_publisher.h"
#include "services/control/control_core.h"
#include "services/control/crtk_publisher.h"

using namespace tandem;

namespace {

/** What both ways of running share: the bus, the topics, the desk for requests. */
struct Service {
  explicit Service(const service::Setup& s)
      : setup(s),
        robot(s.robot, s.deployment.model),
        desk(s, robot),
        core(s, robot, desk.makeTracker()),
        bus(service::busOptions(s.deployment, s.name)),
        crtk(bus, s, robot),
        clearance(bus, s, robot) {
    commands = bus.writer(dds::kActuationCommand);
    limits = bus.writer(dds::kActuationLimits);
    statuses = bus.writer(dds::kControlStatus);
    replies = bus.writer(dds::kControlReply);
  }

  /// Readers; every callback runs on a DDS thread.
  template <class OnState, class OnTips, class OnReference, class OnOrder, class OnStop>
  void listen(OnState on_state, OnTips on_tips, OnReference on_reference, OnOrder on_order, OnStop on_stop) {
    if (setup.deployment.feedback == planning::Feedback::kSensor)
      readers.push_back(bus.reader(dds::kSensingTips, on_tips));
    readers.push_back(bus.reader(dds::kActuationState, on_state));
    readers.push_back(bus.reader(dds::kPlanningReference, on_reference));
    readers.push_back(bus.reader(dds::kControlRequest, [this, on_order](const dds::ControlRequest& request) {
      dds::Reply refusal;
      if (const auto order = desk.parse(request, refusal)) {
        on_order(*order);
      } else {
        spdlog::warn("request refused: {}", refusal.reason);
        replies.write(refusal);
      }
    }));
    readers.push_back(bus.reader(dds::kStop, [on_stop](const dds::Stop& stop) {
      spdlog::error("stop: {}", stop.reason);
      on_stop();
    }));
    for (const std::string& arm : service::armNames(setup.robot)) {
      readers.push_back(bus.reader(dds::kStateCommand, arm, [this, arm, on_order](const dds::StringStamped& command) {
        std::string refusal;
        if (const auto order = desk.parse(arm, command, refusal)) {
          on_order(*order);
        } else {
          spdlog::warn("{}", refusal);
        }
      }));
    }
  }

  /// Calls `tell` with every new fault of an arm.
  template <class Tell>
  void tellFaults(service::FaultWatch& watch, Tell tell) const noexcept {
    for (int k = 0; k < robot.armCount(); ++k) {
      if (watch.fresh(k, core.faultRecord(k)))
        tell(service::FaultReport{k, core.faultRecord(k)});
    }
  }

  void answer(const service::OrderReply& reply) {
    const dds::Reply message = desk.settle(reply);
    if (message.accepted == 0 && message.request != 0)
      spdlog::warn("request refused: {}", message.reason);
    if (message.request != 0)
      replies.write(message);
  }

  const service::Setup& setup;
  experiments::RobotModel robot;
  service::OrderDesk desk;
  service::ControlCore core;
  dds::Bus bus;
  service::CrtkPublisher crtk;
  service::ClearancePublisher clearance;
  dds::Writer<dds::ActuationCommand> commands;
  dds::Writer<dds::ActuationLimits> limits;
  dds::Writer<dds::ControlStatus> statuses;
  dds::Writer<dds::Reply> replies;
  std::vector<dds::Reader> readers;
};

/** Lock-step: one worker thread answers states and references as they come. */
class LockStep {
 public:
  explicit LockStep(Service& service) : service_(service) {}

  void run(service::StopSignal& stop) {
    service_.listen([this](const dds::ActuationState& m) { mailbox_.put(m); },
                    [this](const dds::TipPoses& m) { mailbox_.put(m); },
                    [this](const dds::PlanningReference& m) { mailbox_.put(m); },
                    [this](const service::ControlOrder& m) { mailbox_.put(m); }, [this] { mailbox_.put(dds::Stop{}); });
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
  using Event =
      std::variant<dds::ActuationState, dds::TipPoses, dds::PlanningReference, service::ControlOrder, dds::Stop>;

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
    reference_ = message;
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
      service_.crtk.publish({state_, output_.status, reference_, service_.core.faultRecords()});
      service_.clearance.post(state_);
      last_crtk_ = now;
    }
  }

  Service& service_;
  service::Mailbox<Event> mailbox_;
  service::CycleOutput output_;
  dds::ActuationState state_;
  dds::PlanningReference reference_;
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
        moments_(publisher_.latest<service::Moment>([&](const auto& m) { service_.crtk.publish(m); })),
        answers_(publisher_.queue<service::OrderReply>(256, [&](const auto& m) { service_.answer(m); })),
        faults_(publisher_.queue<service::FaultReport>(64, [&](const auto& m) {
          service::logFault(service_.setup.robot, m);
        })) {}

  void run(service::StopSignal& stop) {
    outbox_.start();
    publisher_.start();
    service_.clearance.start();
    service_.listen([this](const dds::ActuationState& m) { states_.store(m); },
                    [this](const dds::TipPoses& m) { tips_.store(m); },
                    [this](const dds::PlanningReference& m) { references_.store(m); },
                    [this](const service::ControlOrder& m) { putOrder(m); }, [this] { stop_requested_ = true; });
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
    const service::LoopStatistics& s = loop_.statistics();
    service_.core.setTiming({s.execution_last, s.execution_max, s.lateness_max, s.cycles, s.overruns});
    service_.core.cycle(tick.now, false, output_);
    commands_.post(output_.command);
    statuses_.post(output_.status);
    limits_.post(output_.limits);
    beats_.post(s);
    service_.tellFaults(fault_watch_, [this](const service::FaultReport& report) { faults_.post(report); });
    if (tick.cycle % crtk_every_ == 0) {
      moments_.post({state_, output_.status, reference_, service_.core.faultRecords()});
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
  service::Outbox::Queue<service::OrderReply>& answers_;
  service::Outbox::Queue<service::FaultReport>& faults_;
  service::FaultWatch fault_watch_;
  service::LatestValue<dds::ActuationState> states_;
  service::LatestValue<dds::TipPoses> tips_;
  service::LatestValue<dds::PlanningReference> references_;
  std::mutex order_mutex_;
  service::SpscQueue<service::ControlOrder> orders_{64};
  std::atomic<bool> stop_requested_{false};
  dds::ActuationState state_;
  dds::TipPoses measured_;
  dds::PlanningReference reference_;
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
