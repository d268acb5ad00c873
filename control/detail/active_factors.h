// SPDX-License-Identifier: Apache-2.0
/** @file Factors of a quadratic program's Hessian and of its active constraints, updated incrementally. */
#pragma once

#include "control/quadratic_program.h"

namespace tandem::control {

/** J = L^-T Q and R with H = L L^T and L^-1 N = Q [R; 0], where the columns of N are the normals of the active
 * constraints (Goldfarb & Idnani 1983, section 3). Columns of J beyond the active ones span the free space. */
class ActiveFactors {
 public:
  /// Cholesky factorisation of H + shift I, without active constraints. @return false if it is not positive definite.
  bool factorise(const QpMatrix& H, double shift);
  int active() const { return active_; }

  /// x = -H^-1 g.
  void unconstrainedMinimum(const QpVector& g, QpVector& x);

  /// Computes J^T n for a normal; the following functions refer to the last one.
  void take(const QpVector& normal);
  /// The same for the i-th unit vector times `sign`.
  void takeUnit(int i, double sign);
  /// |J_2^T n|^2: its part in the free space; and |J^T n|^2.
  double outside() const { return outside_; }
  double whole() const { return whole_; }
  /// Direction of x toward the constraint: J_2 J_2^T n; call before append().
  const QpVector& primalStep();
  /// Decrease of the active multipliers per unit of the new one: R^-1 J_1^T n.
  const QpVector& dualStep();

  /// Adds the normal to the active ones, after primalStep(). @return false if it depends on them.
  bool append();
  void remove(int position);

  /// Moves x so that the residuals of the active constraints (n^T x - c, in their order) become zero.
  void meet(const QpVector& residual, QpVector& x);
  /// One Newton step in the free space, and the active multipliers, from the gradient of the objective at x.
  void descend(const QpVector& gradient, QpVector& x, QpVector& multiplier);

 private:
  void loadDirection();
  template <int N>
  void combine(int first, QpVector& sum) const;

  int n_ = 0, active_ = 0;
  QpMatrix J_, R_;
  QpVector direction_, primal_, dual_;
  double outside_ = 0.0, whole_ = 0.0;
};

}  // namespace tandem::control
