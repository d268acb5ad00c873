// SPDX-License-Identifier: Apache-2.0
/** @file Arc-length continuation of solution curves around folds. */
#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace tandem::kinematics {

/** Range and step lengths of the continuation; lengths are those of (unknowns, lambda). */
struct ArcLimits {
  double first_step = 0.05, longest_step = 0.3;
  double least_step = 1e-4;  ///< the curve ends if a step would have to be shorter
  int steps = 400;
};

/** Follows the solutions of r(x, lambda) = 0, N equations in N unknowns and a parameter, by pseudo-arclength
 * continuation (Keller 1977): a step along the tangent, then Newton's method in the plane across it, so that lambda may
 * reverse.
 *
 * @param point a solution; has a member move(vector of N) that adds to its unknowns
 * @param sense initial direction of lambda: increasing (1) or decreasing (-1)
 * @param system system(point, lambda, matrix) returns r and fills the N upper rows of matrix with [dr/dx, dr/dlambda]
 * @param visit visit(point, lambda, next_point, next_lambda) is called after every step; false ends the curve
 * Allocates nothing. */
template <int N, class Point, class System, class Visit>
void followArc(Point point,
               double lambda,
               double sense,
               const ArcLimits& limits,
               const System& system,
               const Visit& visit) {
  using Vector = Eigen::Matrix<double, N + 1, 1>;
  using Square = Eigen::Matrix<double, N + 1, N + 1>;
  constexpr double kConverged = 1e-5, kLongestFix = 0.1, kStraight = 0.95;
  constexpr int kMaxIterations = 8;
  Square matrix;
  const auto tangent = [&matrix](const Vector& before) -> Vector {
    matrix.row(N) = before.transpose();
    return matrix.partialPivLu().solve(Vector::Unit(N)).normalized();
  };
  system(point, lambda, matrix);
  Vector along = tangent(Vector::Unit(N));
  along *= std::copysign(1.0, sense * along[N]);
  double step = limits.first_step;
  for (int steps = 0; steps < limits.steps && step > limits.least_step; ++steps) {
    Point next = point;
    next.move(step * along.template head<N>());
    double there = lambda + step * along[N], allowed = kLongestFix;
    bool converged = false;
    for (int iteration = 0; iteration < kMaxIterations && !converged; ++iteration) {
      Vector right = Vector::Zero();
      right.template head<N>() = -system(next, there, matrix);
      matrix.row(N) = along.transpose();
      const Vector correction = matrix.partialPivLu().solve(right);
      const double size = correction.cwiseAbs().maxCoeff();
      if (!(size <= allowed))  // also for NaN
        break;
      next.move(correction.template head<N>());
      there += correction[N];
      converged = size < kConverged;
      allowed = 0.5 * size;
    }
    const Vector onwards = tangent(along);
    if (!converged || !(onwards.dot(along) > kStraight)) {
      step *= 0.5;
      continue;
    }
    if (!visit(point, lambda, next, there))
      return;
    point = next;
    lambda = there;
    along = onwards;
    step = std::min(limits.longest_step, 1.5 * step);
  }
}

}  // namespace tandem::kinematics
