// SPDX-License-Identifier: Apache-2.0
/** @file Factors of a quadratic programme's Hessian and of its active constraints, kept up to date. */
#pragma once

#include "control/quadratic_program.h"

namespace tandem::control {

/** J = L^-T Q and R with H = L L^T and L^-1 N = Q [R; 0], the columns of N being the normals of the active constraints
 * (Goldfarb & Idnani 1983, section 3). Columns of J beyond the active ones span what is still free. */
class ActiveFactors {
 public:
  /// H + shift I by Cholesky's method, no constraint active. @return false if that is not positive definite.
  bool factorise(const QpMatrix& H, double shift);
  int active() const { return active_; }

  /// x = -H^-1 g.
  void unconstrainedMinimum(const QpVector& g, QpVector& x);

  /// J^T n for a normal; what follows refers to the last one.
  void take(const QpVector& normal);
  /// The same for the i-th unit vector times `sign`.
  void takeUnit(int i, double sign);
  /// |J_2^T n|^2: the part of it in what is free; and |J^T n|^2.
  double outside() const { return outside_; }
  double whole() const { return whole_; }
  /// Where x moves when the constraint is approached: J_2 J_2^T n; to be called before append().
  const QpVector& primalStep();
  /// How the active multipliers fall with the new one: R^-1 J_1^T n.
  const QpVector& dualStep();

  /// Makes the normal active, after primalStep(). @return false if it depends on those that are.
  bool append();
  void remove(int position);

  /// x moves by what makes the active constraints' residuals (n^T x - c, in their order) vanish.
  void meet(const QpVector& residual, QpVector& x);
  /// One step of Newton's method in what is free, and the active multipliers, from the gradient of the objective at x.
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
