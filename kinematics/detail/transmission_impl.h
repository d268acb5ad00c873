// SPDX-License-Identifier: Apache-2.0
/** @file Template implementation of the transmission in EndAngleSweep. */
#pragma once

#include "kinematics/detail/transmission.h"
#include "kinematics/end_angle_sweep.h"

namespace tandem::kinematics {

template <class Scalar>
void EndAngleSweep<Scalar>::transmission() {
  base_angle_ = psi_;
  base_by_end_ = psi_by_end_;
  base_by_beta_ = psi_by_beta_;
  for (int i = 0; i < tubes_; ++i) {
    const int entry = parts_.interval[0].section[i];
    const double helix = entry == Segmentation::kAbsent ? 0.0 : arm_.tubes[i].sections[entry].helix_torsion;
    base_angle_[i] -= helixBehindEntry(arm_.tubes[i], beta_[i], helix);
    if (entry != Segmentation::kAbsent)
      base_by_beta_(i, i) += moment_[i] * (1.0 / arm_.tubes[i].sections[entry].torsional_stiffness) + helix;
  }
  const Vector compliance = crossTransmission<Scalar>(arm_, parts_, beta_, [&](const Vector& added, const Scalar& s) {
    const Square z = base_by_end_;
    Square slope;
    for (int i = 0; i < kMaxTubes; ++i)
      slope.row(i) = moment_by_end_.row(i) * Scalar(-added[i]);
    base_by_end_ += slope;
    track_.add(s_, valueOf(s), {z, slope}, {base_by_end_, slope}, [&](double x) {
      return typename DeterminantTrack<Scalar>::Place{(z + slope * Scalar(x)).eval(), slope};
    });
    s_ = valueOf(s);
  });
  for (int i = 0; i < tubes_; ++i) {
    base_angle_[i] -= moment_[i] * compliance[i];
    base_by_beta_.row(i) -= moment_by_beta_.row(i) * compliance[i];
  }
  if constexpr (std::is_same_v<Scalar, double>) {
    Square force;
    force.setIdentity();
    for (int i = 0; i < tubes_; ++i) {
      const int entry = parts_.interval[0].section[i];
      if (entry != Segmentation::kAbsent)
        force.row(i) =
            base_by_end_.row(i) /
            std::max(compliance[i], kShortestTransmission / arm_.tubes[i].sections[entry].torsional_stiffness);
    }
    track_.count(psi_by_end_.transpose() * force);
  }
}

}  // namespace tandem::kinematics
