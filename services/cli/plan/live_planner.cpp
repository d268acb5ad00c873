// SPDX-License-Identifier: Apache-2.0
#include "services/cli/plan/live_planner.h"

#include <cmath>

#include "services/cli/subcommand.h"
#include "services/client/role.h"
#include "services/runtime/periodic_loop.h"

namespace tandem::cli {
namespace {

constexpr double kThere = 10.0;  // s, until planning must be found
constexpr double kPlannerSilence =
    30.0;                           // s, of planning: it computes at a low priority, so others may keep it waiting
constexpr double kKeepAlive = 1.0;  // s
constexpr double kLook = 0.05;      // s

double now() { return 1e-9 * static_cast<double>(runtime::monotonicNow()); }

}  // namespace

LivePlanner::LivePlanner(const config::Deployment& deployment, std::function<bool()> interrupted)
    : interrupted_(std::move(interrupted)), id_(runtime::randomIdentity()), bus_(client::clientOptions(deployment)) {
  if (client::localRole(deployment) != dds::Role::kConsoleOperator)
    throw Failure(kFailure, std::string("computations need role console-operator; this client has role ") +
                                dds::name(client::localRole(deployment)));
  requests_ = bus_.writer(dds::kPlanningCompute);
  const auto put = [this](const auto& message) {
    if (message.client == id_)
      mailbox_.put(message);
  };
  replies_ = bus_.reader(dds::kPlanningReply, put);
  progress_ = bus_.reader(dds::kPlanningProgress, put);
  results_ = bus_.reader(dds::kPlanningResult, put);
  clocks_ = std::make_unique<client::Clocks>(bus_, id_);  // the last endpoint to be created
}

void LivePlanner::send(dds::ComputationKind kind, std::uint64_t computation) {
  dds::ComputationRequest request;
  request.client = id_;
  request.request = next_++;
  request.kind = static_cast<std::uint8_t>(kind);
  request.computation = computation;
  requests_.write(request);
}

void LivePlanner::waitForPlanning() {
  const double deadline = now() + kThere;
  while (!clocks_->found("planning")) {
    if (interrupted_())
      throw Failure(kFailure, "interrupted");
    if (now() > deadline)
      throw Failure(kFailure, "planning was not found (domain " + std::to_string(bus_.options().domain) + ", prefix " +
                                  bus_.options().prefix + "); check that `tandem up` is running");
    mailbox_.take(kLook);
  }
}

dds::ComputationResult LivePlanner::compute(dds::ComputationRequest request, const Progress& progress) {
  waitForPlanning();
  request.client = id_;
  request.request = next_++;
  if (!requests_.write(request))
    throw Failure(kUsage, requests_.lastProblem());
  double received = now(), kept = now();
  bool cancelled = false;
  while (true) {
    const auto event = mailbox_.take(kLook);
    if (event)
      received = now();
    if (interrupted_() && !cancelled) {
      cancelled = true;
      send(dds::ComputationKind::kCancel, request.request);
    }
    if (now() - kept > kKeepAlive) {
      kept = now();
      send(dds::ComputationKind::kKeepAlive, request.request);
    }
    if (now() - received > kPlannerSilence)
      throw Failure(kFailure, "no message from planning for " + std::to_string(std::lround(kPlannerSilence)) +
                                  " s; check that `tandem up` is running");
    if (const auto* reply = event ? std::get_if<dds::Reply>(&*event) : nullptr) {
      const bool malformed = reply->code == static_cast<std::uint16_t>(dds::ReplyCode::kMalformed);
      if (reply->request == request.request && reply->accepted == 0)
        throw Failure(malformed ? kUsage : kFailure, "planning refused: " + reply->reason);
    } else if (const auto* step = event ? std::get_if<dds::ComputationProgress>(&*event) : nullptr) {
      if (step->request == request.request && progress)
        progress(*step);
    } else if (const auto* result = event ? std::get_if<dds::ComputationResult>(&*event) : nullptr) {
      if (result->request == request.request)
        return *result;
    }
  }
}

}  // namespace tandem::cli
