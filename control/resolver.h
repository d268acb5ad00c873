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
  ///
  /// Tasks with an activation h below 1 are blended in: over all subsets S of them, with qdot_S the solution of the
  /// list without those of them that are not in S,
  ///
  ///     qdot = sum over S of w_S qdot_S,   w_S = product over S of h  times  product over the others of (1 - h).
  ///
  /// Every qdot_S keeps the limits, and so does qdot: they are convex. Methods that keep the order of tasks do tasks of
  /// higher priority in all qdot_S alike, so they are not disturbed at any h. Subsets of weight zero are not solved.
  void solve(const StepProblem& problem, Solution& solution) noexcept;

  /// Discards the state of the last step.
  virtual void reset() noexcept {}

 protected:
  explicit Resolver(const MethodParameters& parameters) : parameters_(parameters) {}
  virtual SolveStatus resolve(const StepProblem& problem, Solution& solution) noexcept = 0;
  const MethodParameters parameters_;

 private:
  void solveList(const StepProblem& problem, Solution& solution) noexcept;
  void solveSubset(const StepProblem& problem, unsigned without, Solution& solution) noexcept;
  void blend(const StepProblem& problem, Solution& solution) noexcept;

  StepProblem subset_;  ///< memory of solveSubset()
};

/** @throw std::invalid_argument for parameters out of range, with the value found and the range expected. */
std::unique_ptr<Resolver> makeResolver(Method method, const MethodParameters& parameters);

}  // namespace tandem::control
