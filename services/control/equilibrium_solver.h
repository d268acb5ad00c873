// SPDX-License-Identifier: Apache-2.0
/** @file Background solver of equilibria of the common object, outside the periodic thread. */
#pragma once

#include <optional>
#include <string>

#include "robots/mechanisms.h"
#include "services/runtime/latest_value.h"
#include "services/runtime/outbox.h"
#include "services/runtime/process.h"

namespace tandem::control_service {

/** Computes equilibria at requested joints. The newest request replaces older ones. */
class EquilibriumSolver {
 public:
  /** Request, a plain struct. */
  struct Request {
    std::int64_t stamp = 0;          ///< ns
    std::uint32_t joint_resets = 0;  ///< number of resets of the joints
    int joint_count = 0;
    std::array<double, safety::kMaxJoints> joints{};  ///< m, rad
  };
  struct Result {
    std::int64_t stamp = 0;  ///< of the request
    std::uint32_t joint_resets = 0;
    planning::Equilibrium equilibrium;
  };

  /// @throw std::invalid_argument as robots::makeEquilibriumFollower() does.
  explicit EquilibriumSolver(const runtime::Setup& setup);

  /// Before enterRealtime(): the thread inherits the scheduling of the caller. Without the thread submit() computes the
  /// equilibrium itself and allocates.
  void start();
  void stop() { outbox_.stop(); }

  /// Wait-free; from one thread.
  void submit(const Request& request) noexcept;
  /// Wait-free; from one thread. @return whether there is a new equilibrium.
  bool take(Result& answer) noexcept { return results_.take(answer); }

 private:
  void solveEquilibrium(const Request& request);

  const runtime::Setup& setup_;
  std::optional<robots::EquilibriumFollower> follower_;
  std::uint32_t joint_resets_ = 0;
  std::string last_reason_;  ///< reason of the last failure; empty after a success
  Result result_;
  runtime::LatestValue<Result> results_;
  bool started_ = false;
  runtime::Outbox outbox_;
  runtime::Outbox::Latest<Request>& requests_;
};

}  // namespace tandem::control_service
