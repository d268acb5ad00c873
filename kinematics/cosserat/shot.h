// SPDX-License-Identifier: Apache-2.0
/** @file One shooting step for a rod's boundary value problem, with the pose of its tool tip. */
#pragma once

#include <Eigen/LU>

#include "kinematics/cosserat/sweep.h"
#include "kinematics/rotations.h"

namespace tandem::kinematics::cosserat {

/** Sweep from a moment at the clamp, transferred to the tool tip. The rod is in equilibrium if `residual`, the
 * unbalanced moment at its end, is zero. Twists are those of the tool tip.
 *
 * With a wire of given displacement, its condition g(pull, ...) = 0 is eliminated, dpull = -(g + g_c dc) / g_pull: the
 * residual and all derivatives are then those at constant displacement. */
template <int kColumns>
struct Shot {
  Eigen::Isometry3d tip;
  Eigen::Vector3d residual;                        ///< m - M - d x F, N m, d from the rod's end to the tool tip
  Eigen::Matrix<double, 3, kColumns> residual_by;  ///< by the columns of the sweep
  Eigen::Matrix<double, 3, 6> residual_by_wrench;  ///< by the wrench at the tool tip; from kWrenchColumns on
  Eigen::Matrix<double, 6, kColumns> twist_by;     ///< by the columns of the sweep
  SweepEnd<kColumns> end;
  double wire_residual = 0.0;  ///< g, rad
  double wire_by_pull = 1.0;   ///< g_pull at constant moment at the clamp
  Vector6 twist_by_displacement;
  Eigen::Vector3d residual_by_displacement;
  /// Directions of decreasing energy, with the tool tip held, that the wire removes by its locked displacement: 0 or 1.
  int removed = 0;

  /// @param tool frame of the rod's end <- frame of its load and results
  bool shoot(const SweepStart& start, const Eigen::Isometry3d& tool) noexcept {
    if (!sweep<kColumns>(start, end))
      return false;
    const Wrench wrench = start.load * start.input.tip;
    const Eigen::Vector3d lever = end.pose.linear() * tool.translation();
    const Eigen::Matrix3d arm = skew(lever);
    tip = end.pose * tool;
    residual = end.moment - wrench.tail<3>() - lever.cross(wrench.head<3>());
    residual_by = end.by_moment - skew(wrench.head<3>()) * arm * end.turn;
    twist_by.template topRows<3>() = end.shift - arm * end.turn;
    twist_by.template bottomRows<3>() = end.turn;
    if constexpr (kColumns > kByForce) {
      residual_by.template middleCols<3>(kByForce) -= arm;
    }
    if constexpr (kColumns == kAllColumns) {
      if (start.input.wire.locked())
        lock(start.input.wire, start.pull);
    }
    if constexpr (kColumns > kByForce) {
      residual_by_wrench.template leftCols<3>() = residual_by.template middleCols<3>(kByForce);
      residual_by_wrench.template rightCols<3>() = -Eigen::Matrix3d::Identity();
    }
    return true;
  }

  /// Newton correction, to be added to the pull, for corrections of the moment at the clamp and the force at the tip.
  double pullStep(const Eigen::Vector3d& moment, const Eigen::Vector3d& force) const {
    return -(wire_residual + end.bend_by.template middleCols<3>(kByMoment).dot(moment) +
             end.bend_by.template middleCols<3>(kByForce).dot(force)) /
           wire_by_pull;
  }
  /// Twist by the wire's displacement.
  Vector6 byDisplacement() const {
    return twist_by_displacement - twistByMoment() * residualByMoment().partialPivLu().solve(residual_by_displacement);
  }

  Eigen::Matrix3d residualByMoment() const { return residual_by.template middleCols<3>(kByMoment); }
  Eigen::Matrix<double, 6, 3> twistByMoment() const { return twist_by.template middleCols<3>(kByMoment); }

  /// Newton correction, to be subtracted from the moment at the clamp.
  Eigen::Vector3d momentStep() const { return residualByMoment().partialPivLu().solve(residual); }
  /// Twist by some columns of the sweep, at constant residual.
  template <int kCount>
  Eigen::Matrix<double, 6, kCount> elastic(int column) const {
    return twist_by.template middleCols<kCount>(column) -
           twistByMoment() * residualByMoment().partialPivLu().solve(residual_by.template middleCols<kCount>(column));
  }
  /// Twist by a twist of the clamp's frame at its origin, at constant residual.
  Matrix6 byBase() const {
    Matrix6 result = Matrix6::Identity();
    result.rightCols<3>() = elastic<3>(kByTurn);
    return result;
  }

  /// Derivative of the moment at the clamp by the wrench at the tool tip, at constant residual.
  Eigen::Matrix<double, 3, 6> momentByWrench() const {
    return -residualByMoment().partialPivLu().solve(residual_by_wrench);
  }
  /// Derivative of the tool tip's twist by the wrench there, at constant residual: the compliance.
  Matrix6 compliance() const {
    Matrix6 result = twistByMoment() * momentByWrench();
    result.leftCols<3>() += twist_by.template middleCols<3>(kByForce);
    return result;
  }

 private:
  /// With s the shape, V(s) the energy at constant tension and g = b(s) + e pull, that at constant displacement has the
  /// Hessian V_ss + b_s b_s^T / e (times E I / L). It has one negative eigenvalue less than V_ss if dg/dpull < 0
  /// (Haynsworth's inertia formula on the matrix bordered by b_s), here with the tip held.
  void lock(const Wire& wire, double pull) {
    const Vector6 twist = twist_by.template rightCols<kMaxActuators>() * wire.share;
    const Eigen::Vector3d unbalanced = residual_by.template rightCols<kMaxActuators>() * wire.share;
    wire_residual = end.bend + wire.elasticity * pull - (1.0 + wire.elasticity) * wire.displacement;
    wire_by_pull = end.bend_by.template rightCols<kMaxActuators>() * wire.share + wire.elasticity;
    const Vector6 held = twist_by.template leftCols<kByTurn>().partialPivLu().solve(twist);
    removed = wire_by_pull - end.bend_by.template leftCols<kByTurn>().dot(held) < 0.0 ? 1 : 0;
    residual -= wire_residual / wire_by_pull * unbalanced;
    residual_by -= unbalanced / wire_by_pull * end.bend_by;
    twist_by -= twist / wire_by_pull * end.bend_by;
    residual_by_displacement = (1.0 + wire.elasticity) / wire_by_pull * unbalanced;
    twist_by_displacement = (1.0 + wire.elasticity) / wire_by_pull * twist;
  }
};

}  // namespace tandem::kinematics::cosserat
