// SPDX-License-Identifier: Apache-2.0
/** @file Interface of all redundancy-resolution methods. */
#pragma once

#include <memory>

#include "control/parameters.h"
#include "control/solution.h"

namespace tandem::control {

/** Converts stacked tasks and limits into joint velocities. With the active-set backend solve() does not allocate or
 * throw. One object per control loop: it keeps the state of the last step for a warm start. */
class Resolver {
 public:
  virtual ~Resolver() = default;
  Resolver(const Resolver&) = delete;
  Resolver& operator=(const Resolver&) = delete;

  virtual Method method() const = 0;

  /// Solves one step. If the limits forbid a task, the velocity is the one with the smallest error, and the solution
  /// names those limits; if the problem cannot be solved, the velocity is zero, with the reason in the status.
  void solve(const StepProblem& problem, Solution& solution) noexcept;

  /// Discards the state of the last step.
  virtual void reset() noexcept {}

 protected:
  explicit Resolver(const MethodParameters& parameters) : parameters_(parameters) {}
  virtual SolveStatus resolve(const StepProblem& problem, Solution& solution) noexcept = 0;
  const MethodParameters parameters_;
};

/** @throw std::invalid_argument for parameters out of range, with the value found and the range expected. */
std::unique_ptr<Resolver> makeResolver(Method method, const MethodParameters& parameters);

}  // namespace tandem::control
