// SPDX-License-Identifier: Apache-2.0
/** @file Concentric tubes with bending and torsion: the torsionally compliant model, with or without a load at the
 * tip. */
#pragma once

#include <vector>

#include "kinematics/equilibrium.h"
#include "kinematics/loaded_equilibrium.h"
#include "kinematics/rigid_model.h"
#include "kinematics/stability.h"

namespace tandem::kinematics {

/** Torsionally compliant tubes (Dupont et al. 2010, Rucker et al. 2010).
 *
 * Tubes share the backbone, but twist according to their torsional stiffness:
 *   (c_i psi_i')' = b_i (u_x cos psi_i + u_y sin psi_i),   u = (m_xy + sum_j b_j (-sin psi_j, cos psi_j)) / K,
 * with b_i = K_i kappa_i, K_i = E_i I_i, K the sum over the tubes present, c_i = G_i J_i, psi_i the angle in the
 * torsion-free frame, and m the internal moment, zero without a load. A helical tube bends in a direction that turns
 * along it by tau_i: with psi_i that direction, c_i psi_i' becomes c_i (psi_i' - tau_i), and nothing else changes
 * (Rucker et al. 2010 with the precurvature (0, kappa_i, 0) in a frame of the free tube that turns by tau_i about its
 * tangent). psi_i(beta_i) = alpha_i at the motor; the torsional moment of a tube is zero at its end. Behind the entry
 * point the tubes are guided straight and twist independently.
 *
 * Without a load the tip, its Jacobian and its stability are exact up to 1e-9 m; see Equilibrium for branches.
 */
class CompliantModel final : public TubeModel {
 public:
  /// @throw std::invalid_argument as checkArm() does.
  explicit CompliantModel(ConcentricTubeArm arm);
  CompliantModel(const CompliantModel&) = delete;
  CompliantModel& operator=(const CompliantModel&) = delete;

  using ArmModel::shape;
  using ArmModel::tip;
  bool carriesLoad() const noexcept override { return true; }
  const ArmModel& approximation() const noexcept override { return rigid_; }
  ModelStatus tip(const JointsRef& q, Branch& branch, Tip& tip) const noexcept override;
  ModelStatus loadedTip(const JointsRef& q,
                        const Wrench& wrench,
                        Branch& branch,
                        LoadedTip& tip) const noexcept override;
  ModelStatus shape(const JointsRef& q,
                    const Wrench& wrench,
                    Branch& branch,
                    int points,
                    std::vector<ShapePoint>& shape) const override;

  /// Exact at every s, with central differences for the Jacobians. Allocates nothing if `points` has sufficient
  /// capacity.
  ModelStatus backbone(const JointsRef& q,
                       Branch& branch,
                       const std::vector<double>& s,
                       bool derivatives,
                       std::vector<BackbonePoint>& points) const override;

  /// Stability report, for display and planning: it follows the branch until it ends, so it is not for the periodic
  /// path.
  ModelStatus stability(const JointsRef& q, Branch& branch, Stability& result) const noexcept;
  bool canSnap() const noexcept override { return true; }
  /// Exact, see Stability::gradient.
  Gradient stabilityGradient(const JointsRef& q, const Branch& branch) const override;

  /// All equilibria at the same joints that a search from many end angles finds, by energy, unstable ones included;
  /// none for invalid joints.
  std::vector<EquilibriumInfo> equilibria(const JointsRef& q) const;

  /// Tip-angle parametrisation: one initial value problem with a unique solution.
  /// @param ends [beta_1..beta_n, theta_1..theta_n]: translations, and angles of the tubes' ends, m and rad
  /// @param alpha resulting angles of the motors, rad, n
  /// @param tip with the Jacobian by `ends`; also for unstable equilibria, see Tip::conjugate_points
  ModelStatus tipFromEndAngles(const JointsRef& ends, Eigen::Ref<Eigen::VectorXd> alpha, Tip& tip) const noexcept;

 private:
  ModelStatus unload(const JointsRef& q, Branch& branch) const noexcept;
  template <class Take>
  ModelStatus places(const JointsRef& q, Branch& branch, const std::vector<double>& s, const Take& take) const noexcept;
  ModelStatus loadedShape(const JointsRef& q,
                          const Wrench& wrench,
                          Branch& branch,
                          std::vector<ShapePoint>& shape) const;
  Wrench inArm(const Wrench& wrench) const;

  RigidModel rigid_;
  Equilibrium equilibrium_;
  LoadedEquilibrium loaded_;
};

}  // namespace tandem::kinematics
