// SPDX-License-Identifier: Apache-2.0
/** @file One planning computation of a client, from request to result. No DDS, no threads. */
#pragma once

#include <functional>
#include <optional>

#include "planning/rehearsal.h"
#include "planning/start_choice.h"
#include "services/computation/problem.h"
#include "services/dds/messages.h"

namespace tandem::computation {

/** Callbacks of a computation. Both are called often, on the computing thread; empty ones are not called. */
struct ComputationHooks {
  std::function<bool()> cancelled;
  /// `at` is the counted unit: "point", "start", "round 2, point", "timing".
  std::function<void(double fraction, const std::string& at, int done, int all)> progress;
};

/** One computation, ready to run. The same request gives the same result in every process. */
class Computation {
 public:
  /// As ComputationProblem. @throw Refusal
  Computation(dds::ComputationRequest request,
              const ComputationRobot& robot,
              const std::optional<safety::RobotVector>& present);

  const dds::ComputationRequest& request() const { return problem_.request; }
  /// s
  double timeLimit() const { return request().time_limit > 0.0 ? request().time_limit : 600.0; }

  /// Never throws. The caller sets cancelled_by, the reason of a cancellation, and elapsed.
  dds::ComputationResult run(const ComputationHooks& hooks) const noexcept;

 private:
  planning::IkOptions ik(const ComputationHooks& hooks) const;
  planning::FeasibilityOptions feasibility(const ComputationHooks& hooks, double share) const;
  void check(const ComputationHooks& hooks, dds::ComputationResult& result) const;
  void repair(const ComputationHooks& hooks, dds::ComputationResult& result) const;
  void inverse(const ComputationHooks& hooks, dds::ComputationResult& result) const;
  void time(const ComputationHooks& hooks, dds::ComputationResult& result) const;
  void chooseStart(const ComputationHooks& hooks, dds::ComputationResult& result) const;
  planning::Rehearsal rehearsed(const ComputationHooks& hooks,
                                const std::vector<safety::RobotVector>& postures,
                                const char* at) const;
  planning::FeasibilityReport checked(const ComputationHooks& hooks,
                                      double share,
                                      dds::ComputationResult& result) const;

  ComputationProblem problem_;
};

}  // namespace tandem::computation
