// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>

#include "kinematics/cosserat/sweep.h"
#include "kinematics/spectrum.h"

namespace tandem::kinematics::cosserat {

namespace {

using Matrix63 = Eigen::Matrix<double, 6, 3>;

/// Derivative of (turn, moment) by the same at the clamp.
Matrix6 ofState(const HeldIndex::Columns& columns) {
  Matrix6 result;
  result << columns.block<6, 3>(0, kByTurn), columns.block<6, 3>(0, kByMoment);
  return result;
}

/// Force and moment at a node by its shift and turn, for the rod between clamp and node.
Matrix6 stiffnessBefore(const HeldIndex::Columns& columns) {
  Matrix6 place, wrench;
  place << columns.block<3, 3>(6, kByForce), columns.block<3, 3>(6, kByMoment),  //
      columns.block<3, 3>(0, kByForce), columns.block<3, 3>(0, kByMoment);
  wrench.setIdentity();
  wrench.bottomRows<3>() << columns.block<3, 3>(3, kByForce), columns.block<3, 3>(3, kByMoment);
  return place.transpose().partialPivLu().solve(wrench.transpose()).transpose();
}

/// Stiffness at a node against shift and turn of the piece after it with its end held: T12^-1 T11 of its transfer.
Matrix6 stiffnessBehind(const HeldIndex::Columns& from, const HeldIndex::Columns& to) {
  const Eigen::PartialPivLU<Matrix6> state(ofState(from).transpose());
  const Matrix6 transfer = state.solve(ofState(to).transpose()).transpose();
  const Matrix63 by_force = to.block<6, 3>(0, kByForce) - transfer * from.block<6, 3>(0, kByForce);
  Eigen::Matrix<double, 3, 6> shift_change;
  shift_change << to.block<3, 3>(6, kByTurn) - from.block<3, 3>(6, kByTurn),
      to.block<3, 3>(6, kByMoment) - from.block<3, 3>(6, kByMoment);
  const Eigen::Matrix<double, 3, 6> shift = state.solve(shift_change.transpose()).transpose();
  const Eigen::Matrix3d shift_by_force =
      to.block<3, 3>(6, kByForce) - from.block<3, 3>(6, kByForce) - shift * from.block<6, 3>(0, kByForce);
  Matrix6 by_place, by_wrench;
  by_place << Eigen::Matrix3d::Identity(), shift.leftCols<3>(),  //
      Eigen::Matrix3d::Zero(), transfer.topLeftCorner<3, 3>();
  by_wrench << shift_by_force, shift.rightCols<3>(),  //
      by_force.topRows<3>(), transfer.topRightCorner<3, 3>();
  return by_wrench.partialPivLu().solve(by_place);
}

}  // namespace

void HeldIndex::add(const Columns& columns) {
  const bool inner = !first_ && before_.block<3, 3>(0, kByMoment).cwiseAbs().maxCoeff() > 0.0;
  if (inner)
    count_ += negativeDirections(stiffnessBefore(before_) + stiffnessBehind(before_, columns));
  before_ = columns;
  first_ = false;
}

}  // namespace tandem::kinematics::cosserat
