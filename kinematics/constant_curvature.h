// SPDX-License-Identifier: Apache-2.0
/** @file Rod piece of constant curvature without torsion, in closed form with its derivatives. */
#pragma once

#include <Eigen/Geometry>

namespace tandem::kinematics {

/** Arc of length L with curvature vector u = (u_x, u_y, 0) in the frame of its start: frames obey R' = R [u]x, p' = R
 * e_z.
 *
 * With k = |u| and x = k L:
 *   R(L) = I + f1 [u]x + f2 [u]x^2,   p(L) = f1 e_z + f2 u x e_z,
 *   f1 = sin x / k,  f2 = (1 - cos x) / k^2,  f3 = (x - sin x) / k^3.
 * All are smooth through u = 0 and are evaluated by their series there.
 */
class Arc {
 public:
  Arc(const Eigen::Vector3d& u, double length);

  const Eigen::Matrix3d& rotation() const { return rotation_; }  ///< start frame <- end frame
  const Eigen::Vector3d& position() const { return position_; }  ///< end point in the start frame, m

  /// Change of the end point in the start frame for a change du of u (du_z = 0), m per unit of du.
  Eigen::Vector3d positionDerivative(const Eigen::Vector3d& du) const;

  /// Rotation of the end frame (vector in the start frame) for a change du of u: integral of R(s) du ds.
  Eigen::Vector3d rotationDerivative(const Eigen::Vector3d& du) const;

 private:
  Eigen::Vector3d u_;
  double length_;
  double f1_, f2_, f3_;
  double g1_, g2_;  ///< df1 = g1 u.du, df2 = g2 u.du
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d position_;
};

}  // namespace tandem::kinematics
