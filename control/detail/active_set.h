// SPDX-License-Identifier: Apache-2.0
/** @file QP backend: dense dual active-set method, warm-started, allocation-free. */
#pragma once

#include "control/detail/active_factors.h"
#include "control/detail/scaled_program.h"

namespace tandem::control {

/** Dual active-set method of Goldfarb & Idnani, Mathematical Programming 27 (1983) 1-33.
 *
 * Starts at the unconstrained minimum and adds violated constraints one at a time, each along the shortest dual step
 * that keeps all multipliers of inequalities non-negative; so every iterate is the optimum of a smaller problem, and a
 * problem without feasible point shows itself when a violated constraint cannot be reached: the step's multipliers then
 * are the certificate.
 *
 * Where H is only semidefinite the minimum of
 *
 *   1/2 x^T H x + g^T x + shift/2 |x - x_k|^2    (the proximal point method, Rockafellar 1976)
 *
 * is sought again and again from the last one, x_k, each time warm; its limit is an optimum of the problem itself.
 *
 * A problem is tried as it is; one that is not solved to kExact, or found infeasible, is tried again in units in which
 * its numbers are of the size of one (ScaledProgram), and the better answer counts.
 *
 * Warm start: constraints that were active in the last solution are added first. That changes the order of the steps,
 * never the answer (beyond rounding), and saves those steps that the cold order would take back. */
class ActiveSet final : public QpBackend {
 public:
  void solve(const QuadraticProgram& qp, QpSolution& solution) noexcept override;
  void reset() noexcept override { remembered_ = 0; }

 private:
  static constexpr int kMaxConstraints = kMaxEqualities + 2 * kMaxVariables + kMaxInequalities;
  enum class Kind { kEquality, kLower, kUpper, kRow };
  struct Constraint {
    Kind kind;
    int index;
  };

  void tryScaled(const QuadraticProgram& qp, QpSolution& solution);
  void attempt(const QuadraticProgram& qp, bool strictly, QpSolution& solution);
  Constraint decode(int id) const;
  double slack(int id) const;           ///< n^T x - c, >= 0 where satisfied (equalities: the residual)
  double slackTolerance(int id) const;  ///< below which a violation is rounding
  void takeNormal(int id);
  QpStatus solveStrictly(double shift);
  QpStatus solveSemidefinite();
  void polish(double shift);
  bool isUnbounded(const QpVector& way, double negligible) const;
  QpStatus addEqualities();
  QpStatus addInequalities();
  int mostViolated();
  void propose(int id, double slack);
  QpStatus enforce(int id);  ///< adds one violated inequality, dropping others as needed
  void moveMultipliers(const QpVector& dual_step, double length);
  bool activate(int id, double multiplier);
  void drop(int position);
  void certify(int id, double sign, const QpVector& dual_step);
  void report(QpSolution& solution) const;

  /// All that a step changes.
  struct State {
    ActiveFactors factors;
    QpVector x, multiplier;
    std::array<int, kMaxVariables> active{};
    std::array<bool, kMaxConstraints> is_active{};
  };
  void save(State& state) const;
  void restore(const State& state);

  const QuadraticProgram* qp_ = nullptr;
  int n_ = 0, equalities_ = 0, rows_ = 0, constraints_ = 0;
  ActiveFactors factors_;
  QpVector x_, normal_, gradient_, multiplier_;
  RowVector row_slack_;                      ///< b - A x
  std::array<int, kMaxVariables> active_{};  ///< constraint ids, equalities first
  std::array<bool, kMaxConstraints> is_active_{};
  std::array<bool, kMaxConstraints> is_met_{};      ///< violated by rounding alone, and no step can improve on that
  std::array<bool, kMaxConstraints> was_active_{};  ///< in the last solution of a problem of this size
  int remembered_ = 0;                              ///< constraints_ of that problem; 0 = none
  ScaledProgram scaled_;
  QpSolution again_;
  State before_;       ///< a constraint that may turn out to be met
  double size_ = 0.0;  ///< of the largest variable, in scaled problems on the whole way: what rounding is a part of
  int worst_ = -1, worst_warm_ = -1;
  double amount_ = 0.0, amount_warm_ = 0.0;
  int active_equalities_ = 0;
  /// A certificate: so many entries of active_ and multiplier_, and one more where that is all that there is room for.
  int certified_ = 0;
  struct CertificateEntry {
    int id = -1;
    double multiplier = 0.0;
  } extra_entry_;
  int iterations_ = 0, iteration_limit_ = 0;
};

}  // namespace tandem::control
