// SPDX-License-Identifier: Apache-2.0
/** @file Dense convex quadratic programs, their solutions, and the solver interface. */
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <memory>
#include <string_view>

#include "control/parameters.h"
#include "control/step_problem.h"

namespace tandem::control {

inline constexpr int kMaxEqualities = kMaxTasks * kMaxTaskRows;
/// Joint velocities, one task scale, the damping residual of that task, and slacks of the tasks before it.
inline constexpr int kMaxVariables = safety::kMaxJoints + 1 + kMaxTaskRows + kMaxEqualities;
/// Coupled rows and margins.
inline constexpr int kMaxInequalities = kMaxRows + kMaxBarriers;

using QpMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxVariables, kMaxVariables>;
using QpVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxVariables, 1>;
using EqualityMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxEqualities, kMaxVariables>;
using EqualityVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxEqualities, 1>;
using RowMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxInequalities, kMaxVariables>;
using RowVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxInequalities, 1>;

/**   min 1/2 x^T H x + g^T x   s.t.   E x = e,   lower <= x <= upper,   A x <= b
 *
 * with H symmetric positive semidefinite. Bounds may be infinite, or equal; constraints may be redundant, or contradict
 * each other. */
struct QuadraticProgram {
  QpMatrix H;
  QpVector g;
  EqualityMatrix E;
  EqualityVector e;
  QpVector lower;
  QpVector upper;
  RowMatrix A;
  RowVector b;

  int variables() const { return static_cast<int>(g.size()); }
  int equalities() const { return static_cast<int>(e.size()); }
  int rows() const { return static_cast<int>(b.size()); }
  /// Sets all sizes; matrices are zeroed, bounds infinite.
  void resize(int variables, int equalities, int rows);
};

enum class QpStatus {
  kSolved,
  kInfeasible,  ///< no x satisfies the constraints; the multipliers are a certificate
  kUnbounded,   ///< the objective decreases without bound along a feasible direction
  kIterationLimit,
  kNotConvex,  ///< H has a negative eigenvalue
  kNotFinite,  ///< a value in the problem is not finite
  kFailed,     ///< the backend failed
};
std::string_view describe(QpStatus status);

/** Solution and multipliers: H x + g + E^T y + z_upper - z_lower + A^T w = 0, z, w >= 0.
 *
 * kInfeasible: y, z, w are a certificate (Farkas' lemma): E^T y + z_upper - z_lower + A^T w = 0 with z, w >= 0, while
 * e^T y + upper^T z_upper - lower^T z_lower + b^T w < 0, which no x can satisfy. */
struct QpSolution {
  QpStatus status = QpStatus::kFailed;
  QpVector x;
  EqualityVector y;
  QpVector z;  ///< z_upper - z_lower per variable
  RowVector w;
  int crossed = -1;  ///< kInfeasible: a variable whose own bounds contradict each other; the multipliers are then zero
  int iterations = 0;
  double residual = std::numeric_limits<double>::infinity();  ///< kktResidual() or certificateResidual(), in the units
                                                              ///< of the backend's solution
};

/** Largest violation of the optimality conditions: stationarity relative to its largest term, primal feasibility
 * relative to the largest variable, signs of multipliers and complementarity relative to the largest multiplier.
 * Dimensionless. */
double kktResidual(const QuadraticProgram& qp, const QpSolution& solution) noexcept;

/** Residual of a certificate of infeasibility: its sum relative to its largest term, and signs; infinite if it
 * separates nothing. Dimensionless. */
double certificateResidual(const QuadraticProgram& qp, const QpSolution& solution) noexcept;

/** Whether the multipliers of a solution prove that no x satisfies the constraints (Farkas' lemma; Boyd & Vandenberghe,
 * Convex Optimization, 2004, section 5.8). Every x that satisfies them satisfies their sum with the multipliers y and
 * z, w >= 0,
 *
 *   r^T x <= c,   r = E^T y + z_upper - z_lower + A^T w,   c = e^T y + upper^T z_upper - lower^T z_lower + b^T w.
 *
 * They prove it if c < 0 while r is zero to rounding: |r_i| is at most 1e-10 of the largest product in r, and c below
 * the least value of r^T x within the bounds by 1e-9 of the sum of the absolute values in both. Where x_i has no bound
 * in the direction of -r_i, r_i counts as zero. Neither depends on the units of a constraint. Multipliers of any other
 * origin may be given: what is wrong with them makes the answer false. */
bool provesInfeasible(const QuadraticProgram& qp, const QpSolution& solution) noexcept;

/** A solver of quadratic programs. Not thread-safe; one per thread. */
class QpBackend {
 public:
  virtual ~QpBackend() = default;
  virtual void solve(const QuadraticProgram& qp, QpSolution& solution) noexcept = 0;
  /// Discards the state of former problems.
  virtual void reset() noexcept {}
};

/** active-set: our own, allocation-free; ipopt: interior point, the reference in tests (allocates; not for the periodic
 * path). */
std::unique_ptr<QpBackend> makeQpBackend(Backend backend);

}  // namespace tandem::control
