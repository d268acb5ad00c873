// SPDX-License-Identifier: Apache-2.0
/** @file Taylor-series integration of overlapping curved tubes over one interval, with derivatives. */
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "kinematics/gauss_legendre.h"
#include "kinematics/scalar.h"

namespace tandem::kinematics {

/** Interaction of NC curved tubes over an interval of constant curvature and stiffness.
 *
 * sigma runs from the interval's distal end backwards. With b_i = K_i kappa_i, K = sum of K_i over all tubes present,
 * c_i = G_i J_i, and angles psi_i in the torsion-free frame of the backbone (Dupont et al. 2010, eq. (10)-(18), written
 * without the frame of tube 1):
 *
 *   psi_i'' = g_i sum_j b_j sin(psi_i - psi_j),  g_i = b_i / (K c_i),
 *   u       = sum_j b_j (-sin psi_j, cos psi_j) / K     (curvature of the backbone, 1/m),
 *   R' = -R [u]x,  p' = -R e_z                           (frame at sigma in the frame of the distal end).
 */
template <int NC, class Scalar>
struct CurvedTubes {
  std::array<Scalar, NC> psi;   ///< at the distal end, rad
  std::array<Scalar, NC> rate;  ///< d psi / d sigma there, rad/m
  std::array<double, NC> b;     ///< K_i kappa_i, N m
  std::array<double, NC> g;     ///< b_i / (K c_i), 1/(N m^3); scaled by lambda while torsion is switched on in steps
  double stiffness;             ///< K, N m^2
};

/** Requested outputs of a step. */
enum class StepDepth {
  kAngles,  ///< angles and their transition matrix
  kPose,    ///< also the backbone's pose and its derivatives
};

/** A step from sigma = 0 to h; h is shorter than requested if the series would not converge. */
template <int NC, class Scalar>
class TaylorStep {
 public:
  static constexpr int kStates = 2 * NC;  ///< psi_1..NC, rate_1..NC
  using Matrix = Eigen::Matrix<Scalar, kStates, kStates>;
  using ByState = Eigen::Matrix<Scalar, NC, kStates>;

  /// Expands about the distal end and integrates as far as the series converges, at most `length` (m, above zero).
  TaylorStep(const CurvedTubes<NC, Scalar>& tubes, const Scalar& length, StepDepth depth);

  const Scalar& length() const { return h_; }
  /// Completed share of the requested length, 1 if all.
  double fraction() const { return fraction_; }
  /// At x = sigma / length(), in [0, 1].
  Scalar psi(int tube, double x) const {
    return horner(
        x, [&](int k) { return a_[k][tube]; }, order_ + 3);
  }
  Scalar rate(int tube, double x) const;
  /// Derivative of psi at x by the state at the distal end, NC x 2 NC.
  ByState psiByState(double x) const;
  /// The same of d psi / d sigma.
  ByState rateByState(double x) const;
  /// Derivative of (psi, rate) at the proximal end by the state at the distal end.
  const Matrix& transition() const { return transition_; }

  /// Proximal frame in the distal frame (kPose only).
  const Eigen::Matrix<Scalar, 3, 3>& rotation() const { return rotation_; }
  const Eigen::Matrix<Scalar, 3, 1>& position() const { return position_; }
  /// The same at x.
  Eigen::Matrix<Scalar, 3, 3> rotationAt(double x) const;
  Eigen::Matrix<Scalar, 3, 1> positionAt(double x) const;
  /// Twist of the proximal frame (linear at the distal origin, then angular; distal frame) by the distal state.
  const Eigen::Matrix<Scalar, 6, kStates>& twistByState() const { return twist_; }

 private:
  static constexpr int kMaxOrder = 20;
  static constexpr double kTolerance = 1e-12;  ///< of the last terms, rad and m
  static constexpr int kPairs = NC * (NC - 1) / 2;
  // Columns of unit initial values: tubes 2..NC in angle, then in rate; those of tube 1 follow from a common rotation.
  static constexpr int kColumns = 2 * (NC - 1);
  template <int kSize>
  using Row = std::array<Scalar, kSize == 0 ? 1 : kSize>;

  template <class Coefficient>
  static Scalar horner(double x, Coefficient coefficient, int count) {
    Scalar sum = coefficient(count - 1);
    for (int k = count - 2; k >= 0; --k)
      sum = sum * x + coefficient(k);
    return sum;
  }
  int leastOrder(const CurvedTubes<NC, Scalar>& tubes);
  void expandAngles(const CurvedTubes<NC, Scalar>& tubes);
  void expandAngle(const CurvedTubes<NC, Scalar>& tubes, int k);
  void shorten(double ratio);
  void expandColumns(const CurvedTubes<NC, Scalar>& tubes);
  void expandPose(const CurvedTubes<NC, Scalar>& tubes);
  void integrateTwists(const CurvedTubes<NC, Scalar>& tubes);

  Scalar h_;
  double fraction_ = 1.0;
  int order_ = 0;                                           ///< sines and curvatures have terms 0..order_
  std::array<Row<NC>, kMaxOrder + 3> a_;                    ///< psi, terms 0..order_ + 2
  std::array<Row<kPairs>, kMaxOrder + 1> sin_, cos_;        ///< of psi_i - psi_j, i < j
  std::array<Row<NC>, kMaxOrder + 1> tube_sin_, tube_cos_;  ///< of psi (kPose)
  std::array<Row<kColumns * NC>, kMaxOrder + 3> column_;    ///< [column * NC + tube]
  std::array<Row<4>, kMaxOrder + 2> quaternion_;            ///< w, x, y, z (kPose)
  std::array<Row<3>, kMaxOrder + 2> p_;                     ///< (kPose)
  Matrix transition_;
  Eigen::Matrix<Scalar, 3, 3> rotation_;
  Eigen::Matrix<Scalar, 3, 1> position_;
  Eigen::Matrix<Scalar, 6, kStates> twist_;
};

// Members are in taylor_step_impl.h, for the sources that instantiate them.
extern template class TaylorStep<1, double>;
extern template class TaylorStep<2, double>;
extern template class TaylorStep<3, double>;
extern template class TaylorStep<4, double>;

}  // namespace tandem::kinematics
