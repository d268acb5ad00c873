// SPDX-License-Identifier: Apache-2.0
/** @file Interface of all redundancy-resolution methods. */
#pragma once

#include <memory>

#include "control/parameters.h"
#include "control/solution.h"

namespace tandem::control {

/** Turns stacked tasks and limits into joint velocities. With the active-set backend solve() allocates nothing and
 * throws nothing. One object per control loop: it keeps what it learnt of the last step for a warm start. */
class Resolver {
 public:
  virtual ~Resolver() = default;
  Resolver(const Resolver&) = delete;
  Resolver& operator=(const Resolver&) = delete;

  virtual Method method() const = 0;

  /// Solves one step. A task that the limits forbid gives the velocity that comes nearest to it, and says which limits
  /// those are; a problem that cannot be solved gives zero velocity and says why.
  void solve(const StepProblem& problem, Solution& solution) noexcept;

  /// Forgets the last step.
  virtual void reset() noexcept {}

 protected:
  explicit Resolver(const MethodParameters& parameters) : parameters_(parameters) {}
  virtual SolveStatus resolve(const StepProblem& problem, Solution& solution) noexcept = 0;
  const MethodParameters parameters_;
};

/** @throw std::invalid_argument for parameters out of range: what was found, what is expected. */
std::unique_ptr<Resolver> makeResolver(Method method, const MethodParameters& parameters);

}  // namespace tandem::control
