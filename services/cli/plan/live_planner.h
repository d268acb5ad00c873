// SPDX-License-Identifier: Apache-2.0
/** @file Client of the planning service of a running system, for planning computations. */
#pragma once

#include <functional>
#include <memory>
#include <variant>

#include "services/client/clocks.h"
#include "services/dds/bus.h"
#include "services/runtime/mailbox.h"
#include "services/runtime/process.h"

namespace tandem::cli {

/** Client of planning's topics. It sends keep-alives while it waits, and cancels the computation when interrupted. */
class LivePlanner {
 public:
  /// @param interrupted  polled; true cancels
  LivePlanner(const config::Deployment& deployment, std::function<bool()> interrupted);

  using Progress = std::function<void(const dds::ComputationProgress&)>;
  /// Sets client and request number. A cancelled computation also returns a result.
  /// @throw Failure if planning is missing, times out, or refuses (kUsage for a malformed request)
  dds::ComputationResult compute(dds::ComputationRequest request, const Progress& progress);

 private:
  void send(dds::ComputationKind kind, std::uint64_t computation);
  void waitForPlanning();

  std::function<bool()> interrupted_;
  std::uint64_t id_, next_ = 1;
  runtime::Mailbox<std::variant<dds::Reply, dds::ComputationProgress, dds::ComputationResult>> mailbox_;
  dds::Bus bus_;
  dds::Writer<dds::ComputationRequest> requests_;
  dds::Reader replies_, progress_, results_;
  std::unique_ptr<client::Clocks> clocks_;
};

}  // namespace tandem::cli
