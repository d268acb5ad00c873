// SPDX-License-Identifier: Apache-2.0
/** @file The part of EndAngleSweep behind the entry point. */
#pragma once

#include "kinematics/end_angle_sweep.h"

namespace tandem::kinematics {

/// Behind the entry point every tube twists on its own, down to its motor, through the sections that stand there.
template <class Scalar>
void EndAngleSweep<Scalar>::transmission() {
  base_angle_ = psi_;
  base_by_end_ = psi_by_end_;
  base_by_beta_ = psi_by_beta_;
  Vector compliance;  // F_i, rad / (kMaxTubes m)
  compliance.setConstant(Scalar(0.0));
  Interval part;
  std::array<int, kMaxTubes> section{};
  for (int i = 0; i < tubes_; ++i) {
    section[i] = parts_.interval[0].section[i];
    part.present[i] = section[i] != Segmentation::kAbsent && valueOf(beta_[i]) < 0.0;
    if (section[i] == Segmentation::kAbsent)
      continue;
    part.torsion[i] = arm_.tubes[i].sections[section[i]].torsional_stiffness;
    base_by_beta_(i, i) += moment_[i] * (1.0 / part.torsion[i]);
  }
  // The nearest place, from the entry point backwards, where a tube's section begins; at its first one is its motor.
  const auto begin = [&](int tube) {
    Scalar s = beta_[tube];
    for (int k = 0; k < section[tube]; ++k)
      s += arm_.tubes[tube].sections[k].length;
    return s;
  };
  Scalar s(0.0);
  for (;;) {
    int next = -1;
    for (int i = 0; i < tubes_; ++i) {
      if (part.present[i] && (next < 0 || valueOf(begin(i)) > valueOf(begin(next))))
        next = i;
    }
    if (next < 0)
      break;
    const Scalar length = s - begin(next);
    s = begin(next);
    if (valueOf(length) > 0.0) {
      const Square z = base_by_end_;
      const Square slope = psiSlope(part, length, moment_by_end_);
      base_by_end_ += slope;
      track_.add(s_, valueOf(s), {z, slope}, {base_by_end_, slope}, [&](double x) {
        return typename DeterminantTrack<Scalar>::Place{(z + slope * Scalar(x)).eval(), slope};
      });
      s_ = valueOf(s);
      for (int i = 0; i < tubes_; ++i) {
        if (part.present[i])
          compliance[i] += length * (1.0 / part.torsion[i]);
      }
    }
    part.present[next] = --section[next] >= 0;
    if (part.present[next])
      part.torsion[next] = arm_.tubes[next].sections[section[next]].torsional_stiffness;
  }
  for (int i = 0; i < tubes_; ++i) {
    base_angle_[i] -= moment_[i] * compliance[i];
    base_by_beta_.row(i) -= moment_by_beta_.row(i) * compliance[i];
  }
  if constexpr (std::is_same_v<Scalar, double>) {
    // One piece for the index: a motor right at the entry point is taken as 10 nm behind it.
    constexpr double kShortest = 1e-8;
    Square force;
    force.setIdentity();
    for (int i = 0; i < tubes_; ++i) {
      const int entry = parts_.interval[0].section[i];
      if (entry == Segmentation::kAbsent)
        continue;
      const double least = kShortest / arm_.tubes[i].sections[entry].torsional_stiffness;
      force.row(i) = base_by_end_.row(i) / std::max(compliance[i], least);
    }
    track_.count(psi_by_end_.transpose() * force);
  }
}

}  // namespace tandem::kinematics
