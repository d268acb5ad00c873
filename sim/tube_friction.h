// SPDX-License-Identifier: Apache-2.0
/** @file Coulomb friction between concentric tubes: hysteresis between a motor's rotation and its tube's. */
#pragma once

#include "kinematics/branch.h"
#include "kinematics/concentric_tube.h"

namespace tandem::sim {

/** Rotation of each tube at the base of its curved part, behind the friction between the tubes.
 *
 * Contact forces and moments are those of kinematics/tube_loads.h. A force F on a tube of radius r gives the friction
 * torque mu r F. A concentrated moment M acts as two opposite forces; their distance is taken as one diameter of the
 * tube, so F = M / (2 r), and both together give 2 mu r F = mu M. The largest friction torque of tube i is
 *
 *   tau_i = mu (sum of its concentrated moments |M| + r_i integral |f_i| ds).
 *
 * The motor transmits it through the straight part of the tube, of length L_i and torsional stiffness G J, which winds
 * up by at most
 *
 *   w_i = tau_i L_i / (G J)    (sum over the straight sections before the first curved one).
 *
 * A Coulomb element in series with this spring is the play operator: with the motor at x the tube stays at y until
 * |x - y| = w_i, then it slides, y = clamp(y, x - w_i, x + w_i). A change of direction therefore loses 2 w_i of motor
 * rotation. Lock and Dupont 2011 ("Friction Modeling in Concentric Tube Robots", ICRA) found that concentrated moments
 * explain the measured twist and distributed forces do not; both are included here with one coefficient.
 *
 * Simplifications: friction of translations is left out; the whole torque acts at the base of the curved part; w_i is
 * that of the previous update. Nothing after construction allocates. */
class TubeFriction {
 public:
  /// @param plant arm of the plant; @param nominal that of the robot file, which has straight sections; @param mu
  TubeFriction(kinematics::ConcentricTubeArm plant, const kinematics::ConcentricTubeArm& nominal, double mu);

  /// Reset of the joints: the next positions are without wind-up.
  void restart() noexcept { tubes_.resize(0); }
  /// Moves the motors' side to q, m and rad. @return the same with the rotations behind the friction
  const safety::ArmVector& follow(const safety::ArmVector& q) noexcept;
  /// Sets the wind-up for the next motion. @param branch of the model's result for q; unknown for a rigid model
  void update(const safety::ArmVector& q, const kinematics::Branch& branch) noexcept;
  /// w_i, rad; zero before the first update().
  const kinematics::TubeVector& windUp() const noexcept { return wind_up_; }

 private:
  kinematics::ConcentricTubeArm arm_;
  double mu_;
  kinematics::TubeVector compliance_ = kinematics::TubeVector::Zero();  ///< of the straight parts, rad / (N m)
  kinematics::TubeVector wind_up_ = kinematics::TubeVector::Zero();
  safety::ArmVector tubes_;  ///< empty before the first motion
};

}  // namespace tandem::sim
