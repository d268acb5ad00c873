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

/** One participant on planning's side. It says that it is there while it waits, and cancels where it is interrupted. */
class LivePlanner {
 public:
  /// @param interrupted  asked often; true cancels
  LivePlanner(const config::Deployment& deployment, std::function<bool()> interrupted);

  using Progress = std::function<void(const dds::ComputationProgress&)>;
  /// Fills in client and request. A result that is cancelled is a result.
  /// @throw Failure where planning is not there, falls silent, or refuses (kUsage for what is malformed)
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
