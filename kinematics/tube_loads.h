// SPDX-License-Identifier: Apache-2.0
/** @file Internal loads of concentric tubes without external load: elastic energy and contact between the tubes. */
#pragma once

#include "kinematics/segmentation.h"

namespace tandem::kinematics {

/** Elastic energy of an arm, and the loads that its tubes exert on each other. */
struct TubeLoads {
  double energy = 0.0;                     ///< bending and torsion of all tubes, J
  TubeVector couple = TubeVector::Zero();  ///< sum of the concentrated contact moments of each tube, N m
  TubeVector force = TubeVector::Zero();   ///< integral of the contact force of each tube, N
};

/** Loads at given end angles.
 *
 * With the notation of CompliantModel, in the torsion-free frame, e_i = (-sin psi_i, cos psi_i):
 *
 *   u = sum_j b_j e_j / K,   t_i = c_i (psi_i' - tau_i),   t_i' = b_i (u_x cos psi_i + u_y sin psi_i),   m_i = K_i (u -
 * kappa_i e_i) energy = sum_i integral t_i^2 / (2 c_i) + |m_i|^2 / (2 K_i) ds, from the motors to the ends.
 *
 * The balances of one tube, n_i its internal force, f_i the contact force per length without friction (f_z = 0):
 *
 *   m_i' + t_i (u_y, -u_x) + (-n_y, n_x) = 0,   n_z' = -u . m_i',   f_i = -n_xy' - n_z (u_y, -u_x).
 *
 * The moment m_i jumps where a section begins or ends, a tube ends, or the guide ends (s = 0); each jump is a
 * concentrated contact moment. Jumps of n_xy count as force. In the guide m_i = -b_i e_i turns with psi_i' = tau_i, so
 * |n_i| = |b_i tau_i| and |f_i| = |b_i| tau_i^2. Lock and Dupont 2011 ("Friction Modeling in Concentric
 * Tube Robots", ICRA) divide the contact in the same way. Integration from the ends inwards, Runge-Kutta of order 4.
 *
 * @param beta translations, m
 * @param theta angles of the tubes' ends, rad
 * @param twist false: rigid in torsion, psi_i' = tau_i everywhere
 * Allocates nothing. */
TubeLoads tubeLoads(const ConcentricTubeArm& arm,
                    const Segmentation& parts,
                    const TubeVector& beta,
                    const TubeVector& theta,
                    bool twist = true) noexcept;

}  // namespace tandem::kinematics
