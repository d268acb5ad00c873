// SPDX-License-Identifier: Apache-2.0
/** @file Taylor series of a loaded arm over a piece with constant properties. */
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "kinematics/concentric_tube.h"

namespace tandem::kinematics {

/** Properties of the tubes over an interval. */
struct LoadedPart {
  std::array<bool, kMaxTubes> present{};
  TubeVector b = TubeVector::Zero();           ///< K_i kappa_i, N m
  TubeVector compliance = TubeVector::Zero();  ///< 1 / c_i, 0 for tubes that have ended
  TubeVector helix = TubeVector::Zero();       ///< tau_i, rad/m, 0 for tubes that have ended
  double total = 0.0;                          ///< K, N m^2
  std::array<int, kMaxTubes> curved{};         ///< tubes with b != 0
  int curved_count = 0;

  bool isCurved(int tube) const { return b[tube] != 0.0; }
};

/** State of a loaded arm at s, in the torsion-free frame there. */
struct LoadedState {
  TubeVector psi = TubeVector::Zero();               ///< rad
  TubeVector torsion = TubeVector::Zero();           ///< t_i, N m; their sum is the moment along z
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();  ///< N m, x and y
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< N

  /// Curvature of the backbone, 1/m.
  Eigen::Vector2d bend(const LoadedPart& part) const;
  /// d t_i / ds, N.
  TubeVector torque(const LoadedPart& part) const;
};

/** State and frame at a point of a piece. */
struct LoadedPoint {
  double x;  ///< of the piece, 0 at its distal end, 1 at the other
  LoadedState state;
  Eigen::Matrix3d rotation;  ///< frame in that of the distal end
  Eigen::Vector3d position;  ///< m
};

/** Solution of a piece, in powers of x = sigma / length; sigma runs backwards from its distal end.
 *
 * In the moving frame, with the moment m and the force n of the part of the arm in front of it:
 *
 *   psi_i' = -t_i / c_i - tau_i,  t_i' = -b_i (u_x cos psi_i + u_y sin psi_i),  m' = u x m + e_z x n,  n' = u x n,
 *   u = (m_xy + sum_j b_j (-sin psi_j, cos psi_j)) / K,  m_z = sum_i t_i;  R' = -R [u]x,  p' = -R e_z
 *
 * (R, p: the moving frame in that of the distal end). */
class LoadedSeries {
 public:
  static constexpr int kMaxOrder = 22;
  /// At which a series ends.
  struct Tolerance {
    double terms;        ///< the last ones, rad
    double derivatives;  ///< relative
  };
  static constexpr Tolerance kExact{1e-12, 1e-10};
  static constexpr Tolerance kCoarse{1e-9, 1e-5};  ///< for a step of Newton's method that another one follows

  /// Expands about the distal end. The series converges on x in [0, 1] in the shortened length().
  LoadedSeries(const LoadedPart& part, const LoadedState& start, double length, const Tolerance& tolerance);

  const LoadedPart& part() const { return part_; }
  double length() const { return length_; }  ///< m, at most the requested one
  int order() const { return order_; }       ///< curvatures have terms 0..order
  LoadedPoint at(double x) const;

  /// Terms, for the series of derivatives: of curved tubes (b_i cos psi_i, b_i sin psi_i, their part
  /// b_i (u_y cos psi_i - u_x sin psi_i) of the torque's derivative), curvature, moment along z, force, axes of R.
  template <class Term>
  using Terms = std::array<Term, kMaxOrder + 3>;
  using Tubes = std::array<double, kMaxTubes>;
  struct Coefficients {
    Terms<Tubes> psi, torsion, cosine, sine, own;
    Terms<double> ux, uy, mx, my, mz, nx, ny, nz;
    Terms<Eigen::Vector3d> r1, r2, r3, p;
  };
  const Coefficients& terms() const { return a_; }

 private:
  int leastOrder(double of_derivatives);
  void expand(int k);
  void expandTubes(int k);
  void expandBackbone(int k);
  double size(int k) const;
  void shorten(double ratio);

  const LoadedPart& part_;
  LoadedState start_;
  double length_;
  int order_ = 0;
  Coefficients a_;
};

}  // namespace tandem::kinematics
