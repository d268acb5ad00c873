// SPDX-License-Identifier: Apache-2.0
/** @file State vector layout of LoadedSweep. */
#pragma once

#include "kinematics/loaded_sweep.h"

namespace tandem::kinematics::loaded_state {

inline auto psi(const LoadedSweep::State& y) { return y.segment<kMaxTubes>(0); }
inline auto moments(const LoadedSweep::State& y) { return y.segment<kMaxTubes>(kMaxTubes); }
inline Eigen::Map<const Eigen::Matrix3d> rotation(const LoadedSweep::State& y) {
  return Eigen::Map<const Eigen::Matrix3d>(y.data() + 2 * kMaxTubes);
}
inline auto position(const LoadedSweep::State& y) { return y.segment<3>(2 * kMaxTubes + 9); }

using ColumnMatrix = Eigen::Matrix<double, LoadedSweep::kRows, LoadedSweep::kColumns>;
inline Eigen::Map<const ColumnMatrix> columns(const LoadedSweep::State& y) {
  return Eigen::Map<const ColumnMatrix>(y.data() + LoadedSweep::kBase);
}
inline Eigen::Map<ColumnMatrix> columns(LoadedSweep::State& y) {
  return Eigen::Map<ColumnMatrix>(y.data() + LoadedSweep::kBase);
}
inline constexpr int kTurn = 2 * kMaxTubes, kShift = kTurn + 3;  ///< rows of a column

}  // namespace tandem::kinematics::loaded_state
