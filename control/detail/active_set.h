// SPDX-License-Identifier: Apache-2.0
/** @file QP backend: dense dual active-set method, warm-started, allocation-free. */
#pragma once

#include "control/detail/active_factors.h"
#include "control/detail/scaled_program.h"

namespace tandem::control {

/** Dual active-set method of Goldfarb & Idnani, Mathematical Programming 27 (1983) 1-33.
 *
 * Starts at the unconstrained minimum and adds violated constraints one at a time, each along the shortest dual step
 * that keeps all multipliers of inequalities non-negative; so every iterate is the optimum of a smaller problem. A
 * problem without a feasible point is detected when a violated constraint cannot be satisfied: the step's multipliers
 * are then the certificate.
 *
 * If H is only semidefinite the method minimises
 *
 *   1/2 x^T H x + g^T x + shift/2 |x - x_k|^2    (the proximal point method, Rockafellar 1976)
 *
 * repeatedly, from the last minimum x_k with a warm start; the limit is an optimum of the problem itself.
 *
 * A problem is solved first as it is. If it is neither solved to kExact nor proved infeasible (provesInfeasible()), it
 * is solved again in units in which its values have magnitude one (ScaledProgram), and the better solution counts.
 *
 * Warm start: the inequalities that were active in the last solution are activated together (recall()). That changes
 * the order of the steps, never the solution (beyond rounding), and saves most of them. */
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
  QpStatus solveFrom(double shift);
  QpStatus solveSemidefinite();
  void polish(double shift);
  bool isUnbounded(const QpVector& displacement, double negligible) const;
  QpStatus addEqualities();
  void remember();
  void recall();
  QpStatus addInequalities();
  int mostViolated();
  void propose(int id, double slack);
  QpStatus enforce(int id);  ///< adds one violated inequality, dropping others as needed
  void moveMultipliers(const QpVector& dual_step, double length);
  bool activate(int id, double multiplier);
  void drop(int position);
  void certify(int id, double sign, const QpVector& dual_step);
  void report(QpSolution& solution) const;

  /// All members that a step changes.
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
  RowVector row_slack_;                        ///< b - A x
  std::array<bool, kMaxVariables> in_rows_{};  ///< variables in rows of A
  std::array<int, kMaxVariables> active_{};    ///< constraint ids, equalities first
  std::array<bool, kMaxConstraints> is_active_{};
  std::array<bool, kMaxConstraints> is_met_{};      ///< violated by rounding alone; no step can reduce it
  std::array<int, kMaxVariables> remembered_id_{};  ///< inequalities active in the last solution, in order
  int remembered_active_ = 0;                       ///< their number
  int remembered_ = 0;                              ///< constraints_ of the problem solved last; 0 = none
  QpVector recalled_slack_, recalled_x_, recalled_multiplier_;
  ScaledProgram scaled_;
  QpSolution again_;
  State before_;       ///< state before a constraint that may get is_met_
  double size_ = 0.0;  ///< of the largest variable, in scaled problems over all iterations: reference for rounding
  int worst_ = -1;
  double amount_ = 0.0;
  int active_equalities_ = 0;
  /// Number of certificate entries in active_ and multiplier_; extra_entry_ has the one that does not fit.
  int certified_ = 0;
  struct CertificateEntry {
    int id = -1;
    double multiplier = 0.0;
  } extra_entry_;
  int iterations_ = 0, iteration_limit_ = 0;
};

}  // namespace tandem::control
