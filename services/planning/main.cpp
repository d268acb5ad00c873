// SPDX-License-Identifier: Apache-2.0
/** @file tandem-planning: trajectories and relative poses of two tips, as references for control. */
#include <spdlog/spdlog.h>

#include <optional>
#include <variant>

#include "services/planning/computation_request_handler.h"
#include "services/planning/planning_core.h"
#include "services/runtime/clock_request_handler.h"
#include "services/runtime/diagnostics.h"
#include "services/runtime/identity.h"
#include "services/runtime/mailbox.h"
#include "services/runtime/periodic_loop.h"

using namespace tandem;

namespace {

/** One way in real time and in lock-step: what comes moves the planner. */
class Planner {
 public:
  explicit Planner(const service::Setup& setup)
      : setup_(setup),
        bus_(service::busOptions(setup.deployment, setup.name)),
        references_(bus_.writer(dds::kPlanningReference)),
        replies_(bus_.writer(dds::kPlanningReply)),
        paths_(bus_.writer(dds::kPlanningPath)),
        progress_(bus_.writer(dds::kPlanningProgress)),
        results_(bus_.writer(dds::kPlanningResult)),
        handler_(setup, [this](const auto& message) { std::visit([this](const auto& m) { this->send(m); }, message); }),
        core_(setup),
        diagnostics_(bus_, setup.name, setup.robot.name) {}

  void run(const service::StopSignal& stop) {
    const auto put = [this](const auto& message) { loop_.put(message); };
    const service::MismatchDesk mismatches(
        bus_, [this](const dds::Reply& reply) { replies_.write(reply); }, [] {});
    const auto states = bus_.reader(dds::kActuationState, [this](const dds::ActuationState& message) {
      loop_.put(message);
      handler_.onState(message);
    });
    const auto statuses = bus_.reader(dds::kControlStatus, put);
    std::optional<dds::Reader> tips;
    if (setup_.deployment.feedback == planning::Feedback::kSensor)
      tips = bus_.reader(dds::kSensingTips, put);
    const auto requests = bus_.reader(dds::kPlanningRequest, put);
    const auto computations = bus_.reader(
        dds::kPlanningCompute, [this](const dds::ComputationRequest& request) { handler_.onRequest(request); });
    const service::ClockRequestHandler clock(bus_, setup_);
    spdlog::info("ready: robot {}, {}", setup_.robot.name, setup_.deployment.name);
    std::int64_t published = 0;
    loop_.run(setup_, stop, kRefresh, [&](auto message) {
      if (service::monotonicNow() - published > static_cast<std::int64_t>(1e9 * kRefresh))
        core_.refresh();
      take(std::move(message));
      if (const auto reference = core_.take()) {
        published = service::monotonicNow();
        references_.write(*reference);
        tellHealth(*reference);
      }
    });
  }

 private:
  static constexpr double kRefresh = 0.05;  // s, a fifth of the budget of a reference

  void take(std::monostate) {}
  void take(const dds::ActuationState& state) { core_.onState(state); }
  void take(const dds::TipPoses& tips) { core_.onTips(tips); }
  void take(const dds::ControlStatus& status) { core_.onStatus(status); }
  void take(service::Plan plan) { core_.onPlan(std::move(plan)); }
  void take(const dds::PlanningRequest& request) {
    std::optional<dds::Path> path;
    const dds::Reply reply = core_.onRequest(request, path);
    if (reply.accepted == 0)
      spdlog::warn("request refused: {}", reply.reason);
    if (path)
      paths_.write(*path);
    replies_.write(reply);
  }

  // What the handler of computations has to say; its own thread.
  void send(const dds::Reply& reply) { replies_.write(reply); }
  void send(const dds::ComputationProgress& step) { progress_.write(step); }
  void send(const service::Plan& plan) { loop_.put(plan); }
  void send(const dds::ComputationResult& result) {
    if (results_.write(result))
      return;
    spdlog::error("result of a computation: {}", results_.lastProblem());
    dds::ComputationResult failed;
    failed.client = result.client;
    failed.request = result.request;
    failed.kind = result.kind;
    failed.outcome = static_cast<std::uint8_t>(dds::Outcome::kFailed);
    failed.reason = "the result cannot be sent: " + results_.lastProblem();
    results_.write(failed);
  }

  void tellHealth(const dds::PlanningReference& reference) {
    using Level = service::Diagnostics::Level;
    const auto phase = static_cast<planning::Phase>(reference.phase);
    const bool failed = phase == planning::Phase::kFailed;
    diagnostics_.publish(
        service::monotonicNow(), reference.stamp, failed ? Level::kWarn : Level::kOk,
        std::string(planning::name(phase)) + (failed && !core_.ended().empty() ? ": " + core_.ended() : ""),
        {{"point", std::to_string(reference.point)}, {"points", std::to_string(reference.point_count)}});
  }

  const service::Setup& setup_;
  service::EventLoop<dds::ActuationState, dds::TipPoses, dds::ControlStatus, dds::PlanningRequest, service::Plan> loop_;
  dds::Bus bus_;
  dds::Writer<dds::PlanningReference> references_;
  dds::Writer<dds::Reply> replies_;
  dds::Writer<dds::Path> paths_;
  dds::Writer<dds::ComputationProgress> progress_;
  dds::Writer<dds::ComputationResult> results_;
  service::ComputationRequestHandler handler_;
  service::PlanningCore core_;
  service::Diagnostics diagnostics_;
};

}  // namespace

int main(int argc, char** argv) {
  return service::runService(argc, argv, "planning",
                             "Plans trajectories and relative positions of two tips and asks control to follow them.",
                             [](const service::Setup& setup, service::StopSignal& stop) { Planner(setup).run(stop); });
}
