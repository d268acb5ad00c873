// SPDX-License-Identifier: Apache-2.0
/** @file tandem-planning: executes trajectories and paths as references for control, and computes plans. */
#include <spdlog/spdlog.h>

#include <atomic>
#include <numeric>
#include <optional>
#include <variant>

#include "idl/enumerations.h"
#include "services/planning/computation_request_handler.h"
#include "services/planning/planning_core.h"
#include "services/runtime/clock_request_handler.h"
#include "services/runtime/diagnostics.h"
#include "services/runtime/identity.h"
#include "services/runtime/mailbox.h"
#include "services/runtime/periodic_loop.h"

using namespace tandem;

namespace {

/** Event loop for real time and lock-step: each received message advances the planner. */
class Planner {
 public:
  explicit Planner(const runtime::Setup& setup)
      : setup_(setup),
        bus_(runtime::busOptions(setup.deployment, setup.name)),
        references_(bus_.writer(dds::kPlanningReference)),
        replies_(bus_.writer(dds::kPlanningReply)),
        paths_(bus_.writer(dds::kPlanningPath)),
        summaries_(bus_.writer(dds::kPlanningSummary)),
        progress_(bus_.writer(dds::kPlanningProgress)),
        results_(bus_.writer(dds::kPlanningResult)),
        handler_(setup, [this](const auto& message) { std::visit([this](const auto& m) { this->send(m); }, message); }),
        core_(setup),
        diagnostics_(bus_, setup) {}

  void run(const runtime::StopSignal& stop) {
    const auto put = [this](const auto& message) { loop_.put(message); };
    const runtime::MismatchHandler mismatches(
        bus_, [this](const dds::Reply& reply) { replies_.write(reply); }, [] {});
    const auto states = bus_.reader(dds::kActuationState, [this](const dds::ActuationState& message) {
      loop_.put(message);
      handler_.onState(message);
    });
    const auto statuses = bus_.reader(dds::kControlStatus, put);
    const auto hals = bus_.reader(dds::kHalStatus, [this](const dds::HalStatus& status) {
      gate_interventions_ = std::accumulate(status.guard_count.begin(), status.guard_count.end(), std::uint64_t{0});
    });
    std::optional<dds::Reader> tips;
    if (setup_.deployment.feedback == planning::Feedback::kSensor)
      tips = bus_.reader(dds::kSensingTips, put);
    const auto clearances = bus_.reader(dds::kControlClearance, put);
    const auto requests = bus_.reader(dds::kPlanningRequest, put);
    const auto computations = bus_.reader(
        dds::kPlanningCompute, [this](const dds::ComputationRequest& request) { handler_.onRequest(request); });
    const runtime::ClockRequestHandler clock(bus_, setup_);
    spdlog::info("ready: robot {}, {}", setup_.robot.name, setup_.deployment.name);
    std::int64_t published = 0;
    loop_.run(setup_, stop, kRefresh, [&](auto message) {
      if (runtime::monotonicNow() - published > static_cast<std::int64_t>(1e9 * kRefresh))
        core_.refresh();
      core_.setGateInterventions(gate_interventions_.load(std::memory_order_relaxed));
      take(std::move(message));
      if (const auto summary = core_.takeSummary())
        summaries_.write(*summary);
      if (const auto reference = core_.take()) {
        published = runtime::monotonicNow();
        references_.write(*reference);
        reportHealth(*reference);
      }
    });
  }

 private:
  static constexpr double kRefresh = 0.05;  // s, a fifth of the budget of a reference

  void take(std::monostate) {}
  void take(const dds::ActuationState& state) { core_.onState(state); }
  void take(const dds::TipPoses& tips) { core_.onTips(tips); }
  void take(const dds::ControlStatus& status) { core_.onStatus(status); }
  void take(const dds::Clearances& clearances) { core_.onClearances(clearances); }
  void take(planning_service::Plan plan) { core_.onPlan(std::move(plan)); }
  void take(const dds::PlanningRequest& request) {
    spdlog::info(
        "{}", runtime::requestLine("trajectory " + std::string(idl::name(static_cast<dds::PlanningKind>(request.kind))),
                                   request.client, bus_.identityOf(request.client)));
    std::optional<dds::Path> path;
    const dds::Reply reply = core_.onRequest(request, path);
    if (reply.accepted == 0)
      spdlog::warn("{}", runtime::refusalLine(reply.reason, reply.client, bus_.identityOf(reply.client)));
    if (path)
      paths_.write(*path);
    replies_.write(reply);
  }

  // Messages of the computation request handler, from its sending thread.
  void send(const dds::Reply& reply) { replies_.write(reply); }
  void send(const dds::ComputationProgress& step) { progress_.write(step); }
  void send(const planning_service::Plan& plan) { loop_.put(plan); }
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

  void reportHealth(const dds::PlanningReference& reference) {
    using Level = runtime::Diagnostics::Level;
    const auto phase = static_cast<planning::Phase>(reference.phase);
    const bool failed = phase == planning::Phase::kFailed;
    diagnostics_.publish(
        reference.stamp, failed ? Level::kWarn : Level::kOk,
        std::string(planning::name(phase)) + (failed && !core_.ended().empty() ? ": " + core_.ended() : ""),
        {{"point", std::to_string(reference.point)},
         {"points", std::to_string(reference.point_count)},
         {runtime::kTrajectoryKey + std::to_string(reference.trajectory_id), core_.trajectory()}});
  }

  const runtime::Setup& setup_;
  std::atomic<std::uint64_t> gate_interventions_{0};
  runtime::EventLoop<dds::ActuationState,
                     dds::TipPoses,
                     dds::ControlStatus,
                     dds::Clearances,
                     dds::PlanningRequest,
                     planning_service::Plan>
      loop_;
  dds::Bus bus_;
  dds::Writer<dds::PlanningReference> references_;
  dds::Writer<dds::Reply> replies_;
  dds::Writer<dds::Path> paths_;
  dds::Writer<dds::RunSummary> summaries_;
  dds::Writer<dds::ComputationProgress> progress_;
  dds::Writer<dds::ComputationResult> results_;
  planning_service::ComputationRequestHandler handler_;
  planning_service::PlanningCore core_;
  runtime::Diagnostics diagnostics_;
};

}  // namespace

int main(int argc, char** argv) {
  return runtime::runService(
      argc, argv, "planning",
      "Plans trajectories and relative positions of two tips, and sends them to control as references.",
      [](const runtime::Setup& setup, runtime::StopSignal& stop) { Planner(setup).run(stop); });
}
