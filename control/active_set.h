// SPDX-License-Identifier: Apache-2.0
/** @file Our own QP backend: a dense dual active-set method, warm-started, without allocation. */
#pragma once

#include "control/quadratic_program.h"

namespace tandem::control {

/** Dual active-set method of Goldfarb & Idnani, Mathematical Programming 27 (1983) 1-33.
 *
 * Starts at the unconstrained minimum and adds violated constraints one at a time, each along the shortest dual step
 * that keeps all multipliers of inequalities non-negative; so every iterate is the optimum of a smaller problem, and a
 * problem without feasible point shows itself when a violated constraint cannot be reached. J = L^-T Q and R are kept
 * up to date by Givens rotations, N = L Q [R; 0] being the active normals.
 *
 * Warm start: constraints that were active in the last solution are added first. That changes the order of the steps,
 * never the answer (beyond rounding), and saves those steps that the cold order would take back.
 */
class ActiveSet final : public QpBackend {
 public:
  void solve(const QuadraticProgram& qp, QpSolution& solution) noexcept override;
  void reset() noexcept override { remembered_ = 0; }

 private:
  static constexpr int kMaxConstraints = kMaxEqualities + 2 * kMaxVariables + kMaxRows;
  enum class Kind { kEquality, kLower, kUpper, kRow };
  struct Constraint {
    Kind kind;
    int index;
  };

  Constraint decode(int id) const;
  double slack(int id) const;           ///< n^T x - c, >= 0 where satisfied (equalities: the residual)
  double slackTolerance(int id) const;  ///< below which a violation is rounding
  void loadNormal(int id);              ///< normal_ and direction_ = J^T normal_
  bool prepare();                       ///< factorises H, unconstrained minimum
  QpStatus addEqualities();
  QpStatus addInequalities();
  int mostViolated();
  QpStatus enforce(int id);  ///< adds one violated inequality, dropping others as needed
  void steps();              ///< primal step_ and dual_step_ for direction_
  bool pushActive(int id, double multiplier);
  void dropActive(int position);
  void report(QpSolution& solution);

  /// All that a step changes.
  struct State {
    QpMatrix J, R;
    QpVector x, multiplier;
    std::array<int, kMaxVariables> active{};
    std::array<bool, kMaxConstraints> is_active{};
    int active_count = 0;
  };
  void save(State& state) const;
  void restore(const State& state);

  const QuadraticProgram* qp_ = nullptr;
  int n_ = 0, equalities_ = 0, rows_ = 0, constraints_ = 0;
  QpMatrix J_, R_;
  QpVector x_, normal_, direction_, step_, dual_step_, multiplier_;
  std::array<int, kMaxVariables> active_{};  ///< constraint ids, equalities first
  std::array<bool, kMaxConstraints> is_active_{};
  std::array<bool, kMaxConstraints> is_met_{};      ///< violated by rounding alone, and no step can improve on that
  std::array<bool, kMaxConstraints> was_active_{};  ///< in the last solution of a problem of this size
  int remembered_ = 0;                              ///< constraints_ of that problem; 0 = none
  State before_;                                    ///< a constraint that may turn out to be met
  double size_ = 0.0;                               ///< of the largest variable
  int active_count_ = 0, active_equalities_ = 0;
  int iterations_ = 0, iteration_limit_ = 0;
};

}  // namespace tandem::control
