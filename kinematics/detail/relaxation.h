// SPDX-License-Identifier: Apache-2.0
/** @file Relaxation of an elastic arm: descent of its energy to a minimum. */
#pragma once

#include "kinematics/segmentation.h"

namespace tandem::kinematics {

/** Minimises the energy of the unloaded arm over the angles psi_i(s) of its tubes, starting at given ones:
 *
 *   min  sum_i integral c_i (psi_i' - tau_i)^2 / 2 ds - integral |sum_i b_i exp(i psi_i)|^2 / (2 K) ds
 *        + sum_i (psi_i(0) - alpha_i - integral of tau_i behind the entry point)^2 / (2 F_i)
 *
 * (Dupont et al. 2010, eq. (13), without the part that does not depend on psi; F_i is the compliance of the
 * transmission.) Finite elements along s, Newton's method with damping, so that every step decreases the energy. The
 * result is a stable equilibrium up to the discretisation error, which a boundary value solver then removes.
 *
 * @param nudge rotations of the ends that move the arm away from an equilibrium that may be a saddle, rad
 * @param theta angles of the tubes' ends, rad: in, initial; out, at the minimum
 * @return false if the bounded number of iterations did not suffice.
 * Allocates nothing. */
bool relax(const ConcentricTubeArm& arm,
           const Segmentation& parts,
           const JointsRef& q,
           const TubeVector& nudge,
           TubeVector& theta) noexcept;

}  // namespace tandem::kinematics
