// SPDX-License-Identifier: Apache-2.0
/** @file tandem-planning: trajectories and relative poses of two tips, as references for control. */
#include <spdlog/spdlog.h>

#include <variant>

#include "services/common/mailbox.h"
#include "services/common/periodic_loop.h"
#include "services/planning/computation_desk.h"
#include "services/planning/planning_core.h"
#include "services/setup/clock_desk.h"
#include "services/setup/diagnostics.h"

using namespace tandem;

namespace {

using Event = std::variant<dds::ActuationState, dds::TipPoses, dds::ControlStatus, dds::PlanningRequest, service::Plan>;

void run(const service::Setup& setup, service::StopSignal& stop) {
  service::Mailbox<Event> mailbox;
  dds::Bus bus(service::busOptions(setup.deployment, setup.name));
  auto references = bus.writer(dds::kPlanningReference);
  auto replies = bus.writer(dds::kPlanningReply);
  auto paths = bus.writer(dds::kPlanningPath);
  const auto put = [&](const auto& message) { mailbox.put(message); };
  auto progress = bus.writer(dds::kPlanningProgress);
  auto results = bus.writer(dds::kPlanningResult);
  service::ComputationDesk desk(setup, [&](const service::ComputationDesk::Outgoing& message) {
    if (const auto* reply = std::get_if<dds::Reply>(&message))
      replies.write(*reply);
    else if (const auto* step = std::get_if<dds::ComputationProgress>(&message))
      progress.write(*step);
    else if (const auto* plan = std::get_if<service::Plan>(&message))
      mailbox.put(*plan);
    else if (const auto& result = std::get<dds::ComputationResult>(message); !results.write(result)) {
      spdlog::error("result of a computation: {}", results.lastProblem());
      dds::ComputationResult failed;
      failed.client = result.client;
      failed.request = result.request;
      failed.kind = result.kind;
      failed.outcome = static_cast<std::uint8_t>(dds::Outcome::kFailed);
      failed.reason = "the result cannot be sent: " + results.lastProblem();
      results.write(failed);
    }
  });
  auto states = bus.reader(dds::kActuationState, [&](const dds::ActuationState& message) {
    mailbox.put(message);
    desk.onState(message);
  });
  auto statuses = bus.reader(dds::kControlStatus, put);
  std::optional<dds::Reader> tips;
  if (setup.deployment.feedback == planning::Feedback::kSensor)
    tips = bus.reader(dds::kSensingTips, put);
  auto requests = bus.reader(dds::kPlanningRequest, put);
  auto computations =
      bus.reader(dds::kPlanningCompute, [&](const dds::ComputationRequest& request) { desk.onRequest(request); });

  service::PlanningCore core(setup);
  service::Diagnostics diagnostics(bus, setup.name, setup.robot.name);
  const service::ClockDesk clock(bus, setup);
  spdlog::info("ready: robot {}, {}", setup.robot.name, setup.deployment.name);
  constexpr double kRefresh = 0.05;  // s, a fifth of the budget of a reference
  std::int64_t published = 0;
  while (!stop.requested()) {
    auto event = mailbox.take(kRefresh);
    setup.heartbeat->beat();
    if (service::monotonicNow() - published > static_cast<std::int64_t>(1e9 * kRefresh))
      core.refresh();
    if (const auto* state = event ? std::get_if<dds::ActuationState>(&*event) : nullptr) {
      core.onState(*state);
    } else if (const auto* measured = event ? std::get_if<dds::TipPoses>(&*event) : nullptr) {
      core.onTips(*measured);
    } else if (const auto* status = event ? std::get_if<dds::ControlStatus>(&*event) : nullptr) {
      core.onStatus(*status);
    } else if (auto* plan = event ? std::get_if<service::Plan>(&*event) : nullptr) {
      core.onPlan(std::move(*plan));
    } else if (const auto* request = event ? std::get_if<dds::PlanningRequest>(&*event) : nullptr) {
      std::optional<dds::Path> path;
      const dds::Reply reply = core.onRequest(*request, path);
      if (reply.accepted == 0)
        spdlog::warn("request refused: {}", reply.reason);
      if (path)
        paths.write(*path);
      replies.write(reply);
    }
    if (const auto reference = core.take()) {
      published = service::monotonicNow();
      references.write(*reference);
      const auto phase = static_cast<planning::Phase>(reference->phase);
      using Level = service::Diagnostics::Level;
      diagnostics.publish(
          service::monotonicNow(), reference->stamp, phase == planning::Phase::kFailed ? Level::kWarn : Level::kOk,
          std::string(planning::name(phase)) +
              (phase == planning::Phase::kFailed && !core.ended().empty() ? ": " + core.ended() : ""),
          {{"point", std::to_string(reference->point)}, {"points", std::to_string(reference->point_count)}});
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  return service::runService(argc, argv, "planning",
                             "Plans trajectories and relative positions of two tips and asks control to follow them.",
                             run);
}
