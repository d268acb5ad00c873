// SPDX-License-Identifier: Apache-2.0
/** @file Straight guided part of the tubes between motors and entry point. */
#pragma once

#include "kinematics/scalar.h"
#include "kinematics/segmentation.h"

namespace tandem::kinematics {

/// For the index of an equilibrium, a motor at the entry point counts as this far behind it, m.
inline constexpr double kShortestTransmission = 1e-8;

/// Angle by which a tube bends in another direction at the entry point, or at its end behind it, than at its motor if
/// it does not twist: the integral of tau, rad. @param beta s of its motor, m @param torsion tau at the entry point,
/// rad/m
template <class Scalar>
Scalar helixBehindEntry(const Tube& tube, const Scalar& beta, double torsion) {
  const double at = valueOf(beta);
  return Scalar(tube.helixAngle(-at)) - Scalar(torsion) * (beta - Scalar(at));  // with the derivative by beta
}

/** Traverses the transmission from the entry point back to the farthest motor, in pieces with constant tube sections.
 * Behind the entry point every tube is guided straight and twists independently, by its moment times the compliance of
 * the pieces.
 *
 * @param beta s of the motors, m
 * @param take take(added, s) is called for every piece, with the compliance that it adds to each tube, rad/(N m), and
 * the s at which it ends, m
 * @return F_i, the compliance of each tube's transmission, rad/(N m) */
template <class Scalar, class Take>
Eigen::Matrix<Scalar, kMaxTubes, 1> crossTransmission(const ConcentricTubeArm& arm,
                                                      const Segmentation& parts,
                                                      const Eigen::Matrix<Scalar, kMaxTubes, 1>& beta,
                                                      const Take& take) {
  using Vector = Eigen::Matrix<Scalar, kMaxTubes, 1>;
  const Scalar none(0.0);
  Vector sum = Vector::Constant(none);
  std::array<int, kMaxTubes> section{};  // below zero: s is behind the tube's motor, or the tube does not exist
  for (int i = 0; i < kMaxTubes; ++i) {
    const bool present = i < arm.tubeCount() && parts.interval[0].section[i] != Segmentation::kAbsent;
    section[i] = present && valueOf(beta[i]) < 0.0 ? parts.interval[0].section[i] : -1;
  }
  const auto begin = [&](int tube) {
    Scalar s = beta[tube];
    for (int k = 0; k < section[tube]; ++k)
      s += arm.tubes[tube].sections[k].length;
    return s;
  };
  for (Scalar s(0.0);;) {
    int next = -1;
    for (int i = 0; i < arm.tubeCount(); ++i) {
      if (section[i] >= 0 && (next < 0 || valueOf(begin(i)) > valueOf(begin(next))))
        next = i;
    }
    if (next < 0)
      return sum;
    const Scalar length = s - begin(next);
    s = begin(next);
    if (valueOf(length) > 0.0) {
      Vector added = Vector::Constant(none);
      for (int i = 0; i < arm.tubeCount(); ++i) {
        if (section[i] >= 0)
          added[i] = length * (1.0 / arm.tubes[i].sections[section[i]].torsional_stiffness);
      }
      sum += added;
      take(added, s);
    }
    --section[next];
  }
}

}  // namespace tandem::kinematics
