// SPDX-License-Identifier: Apache-2.0
/** @file Factors of a quadratic program's Hessian and of its active constraints, updated incrementally. */
#pragma once

#include "control/quadratic_program.h"

namespace tandem::control {

/** J = L^-T Q and R with H = L L^T and L^-1 N = Q [R; 0], where the columns of N are the normals of the active
 * constraints (Goldfarb & Idnani 1983, section 3). Columns of J beyond the active ones span the free space.
 *
 * Until a normal is removed, J can stay a product of the base J_0 = L^-T, a vector if H is diagonal, and of one
 * reflection for each normal: that is faster where few are removed, with a diagonal H and after a warm start. */
class ActiveFactors {
 public:
  /// Cholesky factorisation of H + shift I, without active constraints; that of the last one is used again if it is the
  /// same. @return false if it is not positive definite.
  /// @param few few normals will be removed
  bool factorise(const QpMatrix& H, double shift, bool few);
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
  /// Direction of x toward the constraint: J_2 J_2^T n.
  const QpVector& primalStep();
  /// Decrease of the active multipliers per unit of the new one: R^-1 J_1^T n.
  const QpVector& dualStep();

  /// Adds the normal to the active ones, after primalStep() unless `few` and none was removed. @return false if it
  /// depends on them.
  bool append();
  void remove(int position);

  /// Moves x so that the residuals of the active constraints (n^T x - c, in their order) become zero, on the shortest
  /// way in the norm of H. @return increase of their multipliers
  const QpVector& meet(const QpVector& residual, QpVector& x);
  /// One Newton step in the free space, and the active multipliers, from the gradient of the objective at x.
  void descend(const QpVector& gradient, QpVector& x, QpVector& multiplier);

 private:
  bool isLast(const QpMatrix& H, double shift) const;
  void loadDirection();
  void divideByR();
  template <int N>
  void turn(QpVector& direction) const;
  template <int N>
  auto sum(const QpVector& direction, int first) const;
  template <int N>
  void combine(QpVector& direction, QpVector& combined) const;
  void keep(int largest, double h);
  void reflect(int largest, double turned, double h);
  void multiplyOut();

  int n_ = 0, active_ = 0;
  bool diagonal_ = false;
  bool product_ = false;  ///< J is kept as a product
  QpVector scale_;        ///< J_0 if diagonal_
  QpMatrix J_;            ///< J_0 otherwise
  QpMatrix last_hessian_,
      last_inverse_;  ///< of the last factorisation of a matrix that is not diagonal, and its J_0; or empty
  double last_shift_ = 0.0;
  /// Reflections not yet in J_: I - w w^T / h after an exchange of two entries. Rows of w in front of `first` are zero.
  int reflections_ = 0;
  QpMatrix w_;
  QpVector h_;
  std::array<int, kMaxVariables> first_{}, largest_{};
  QpMatrix R_;
  QpVector direction_, primal_, dual_;
  double outside_ = 0.0, whole_ = 0.0;
};

}  // namespace tandem::control
