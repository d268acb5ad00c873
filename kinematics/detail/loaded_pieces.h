// SPDX-License-Identifier: Apache-2.0
/** @file Columns of LoadedSweep over one piece. */
#pragma once

#include "kinematics/detail/loaded_columns.h"
#include "kinematics/loaded_sweep.h"
#include "kinematics/rotations.h"

namespace tandem::kinematics::loaded_pieces {

/// Rows of a column, those of vectors in the moving frame: psi, t, moment, force, turn, shift.
inline constexpr int kTorsion = kMaxTubes, kMoment = 2 * kMaxTubes, kForce = kMoment + 2, kTurn = kForce + 3;
inline constexpr int kShift = kTurn + 3;
inline constexpr int kRows = LoadedSweep::kRows;
template <int C>
using Columns = Eigen::Matrix<double, kRows, C>;

/// State of the piece's curved tubes and backbone that its series start from: N = 2 * curved tubes + 6 numbers (psi, t,
/// sum of the straight tubes' t, moment, force).
template <int N, int C>
Eigen::Matrix<double, N, C> startOf(const LoadedPart& part, const Columns<C>& columns) {
  Eigen::Matrix<double, N, C> start;
  const int count = part.curved_count;
  for (int c = 0; c < count; ++c) {
    start.row(c) = columns.row(part.curved[c]);
    start.row(count + c) = columns.row(kTorsion + part.curved[c]);
  }
  start.row(2 * count).setZero();
  for (int i = 0; i < kMaxTubes; ++i) {
    if (part.present[i] && !part.isCurved(i))
      start.row(2 * count) += columns.row(kTorsion + i);
  }
  start.template bottomRows<5>() = columns.template middleRows<5>(kMoment);
  return start;
}

/// Columns of the series at a point; rows of tubes that are not curved are zero, turn and shift relative to the
/// start's.
template <int N>
Columns<N> endOf(const LoadedPart& part, const typename LoadedColumns<N>::End& end) {
  Columns<N> columns = Columns<N>::Zero();
  for (int c = 0; c < part.curved_count; ++c) {
    columns.row(part.curved[c]) = end.psi[c].matrix().transpose();
    columns.row(kTorsion + part.curved[c]) = end.torsion[c].matrix().transpose();
  }
  for (int i = 0; i < 2; ++i)
    columns.row(kMoment + i) = end.moment[i].matrix().transpose();
  for (int i = 0; i < 3; ++i) {
    columns.row(kForce + i) = end.force[i].matrix().transpose();
    columns.row(kTurn + i) = end.turn[i].matrix().transpose();
    columns.row(kShift + i) = end.shift[i].matrix().transpose();
  }
  return columns;
}

/// Adds to the columns at a point what the series leave out: tubes that are not curved, and the start's turn and shift.
template <int C>
void addPassive(const LoadedSeries& series, const LoadedPoint& point, const Columns<C>& start, Columns<C>& columns) {
  const LoadedPart& part = series.part();
  for (int i = 0; i < kMaxTubes; ++i) {
    if (part.isCurved(i))
      continue;
    columns.row(i) = start.row(i) - (point.x * series.length() * part.compliance[i]) * start.row(kTorsion + i);
    columns.row(kTorsion + i) = start.row(kTorsion + i);
  }
  const Eigen::Matrix3d back = point.rotation.transpose();
  const Eigen::Matrix3d lever = -skew(point.position);
  const auto turn = start.template middleRows<3>(kTurn);
  columns.template middleRows<3>(kTurn) += back * turn;
  columns.template middleRows<3>(kShift) += back * (start.template middleRows<3>(kShift) + lever * turn);
}

/// Columns at a point of a piece with this transition matrix from its start to the point.
template <int N, int C>
Columns<C> carried(const LoadedSeries& series,
                   const Columns<N>& transition,
                   const LoadedPoint& point,
                   const Columns<C>& start) {
  Columns<C> columns = transition.lazyProduct(startOf<N, C>(series.part(), start));
  addPassive(series, point, start, columns);
  return columns;
}

/// Unit starts: the columns are then the transition matrix.
template <int N>
typename LoadedColumns<N>::Start unitStart(int curved_count) {
  using Row = typename LoadedColumns<N>::Row;
  typename LoadedColumns<N>::Start start;
  int next = 0;
  const auto unit = [&]() -> Row { return Row(Eigen::Matrix<double, N, 1>::Unit(next++).array()); };
  for (int c = 0; c < curved_count; ++c)
    start.psi[c] = unit();
  for (int c = 0; c < curved_count; ++c)
    start.torsion[c] = unit();
  start.straight = unit();
  for (Row& row : start.moment)
    row = unit();
  for (Row& row : start.force)
    row = unit();
  return start;
}

/// Given starts: the columns are those that grow from them.
template <int N>
typename LoadedColumns<N>::Start givenStart(const LoadedPart& part, const Columns<N>& columns) {
  typename LoadedColumns<N>::Start start;
  const auto row = [&](int i) { return columns.row(i).transpose().array(); };
  start.straight.setZero();
  for (int c = 0; c < part.curved_count; ++c) {
    start.psi[c] = row(part.curved[c]);
    start.torsion[c] = row(kTorsion + part.curved[c]);
  }
  for (int i = 0; i < kMaxTubes; ++i) {
    if (part.present[i] && !part.isCurved(i))
      start.straight += row(kTorsion + i);
  }
  for (int i = 0; i < 2; ++i)
    start.moment[i] = row(kMoment + i);
  for (int i = 0; i < 3; ++i)
    start.force[i] = row(kForce + i);
  return start;
}

}  // namespace tandem::kinematics::loaded_pieces
