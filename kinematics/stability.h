// SPDX-License-Identifier: Apache-2.0
/** @file Elastic stability of an arm: distance to snapping, and other equilibria. */
#pragma once

#include <array>
#include <vector>

#include "kinematics/arm_model.h"

namespace tandem::kinematics {

/** Elastic stability of an unloaded equilibrium; see DeterminantTrack for the measure and its sources. */
struct Stability {
  double minimum = 1.0;      ///< smallest determinant along the arm; 1 without elastic interaction, 0 at a bifurcation
  double at = 0.0;           ///< its arc length s, m; below zero in the transmission
  int conjugate_points = 0;  ///< zeros of the determinant along the arm, by multiplicity; 0: stable
  Gradient gradient;         ///< of the minimum by the joints, 1/m and 1/rad; zero where the minimum is 1 at the end
  /// Smallest rotation of a single tube that takes the arm to the end of its branch, rad; infinite if no tube reaches
  /// it within a full turn.
  double rotation_left = 0.0;
  int rotation_tube = 0;   ///< this tube, from 0
  int rotation_sense = 0;  ///< direction of this rotation: +1, -1, or 0 if there is none
};

/** One of the equilibria at the same joints. */
struct EquilibriumInfo {
  Branch branch;                         ///< to continue from it
  std::array<int, kMaxTubes> winding{};  ///< identifies the branch, see Branch::winding()
  double energy = 0.0;  ///< elastic energy of the tubes in front of the entry point and of the transmission's twist, J
  double stability = 1.0;    ///< smallest determinant along the arm
  int conjugate_points = 0;  ///< 0: stable; else directions in which the energy decreases
};

}  // namespace tandem::kinematics
