// SPDX-License-Identifier: Apache-2.0
/** @file Branch: selects one of several equilibria of an elastic arm. */
#pragma once

#include <array>

#include "kinematics/concentric_tube.h"
#include "safety/dimensions.h"

namespace tandem::kinematics {

/** State of an elastic arm that is tracked along a joint path.
 *
 * Elastic tubes may have several stable equilibria at the same joints; which one a real arm is in depends on its path.
 * A model continues from the Branch of its last result and updates it. A new Branch requests a cold start: the
 * equilibrium that develops from untwisted tubes as their torsional stiffness falls from infinite to the real one.
 * Rigid models have one result and do not change a Branch. */
struct Branch {
  bool known = false;    ///< there is a last result
  bool snapped = false;  ///< before the last result the tracked equilibrium ended, and the arm snapped to another one
  double snap_energy = 0.0;    ///< elastic energy released by these snaps, J; 0 under a load: not computed
  double snap_distance = 0.0;  ///< distance between the tool tips before and after each of them, m, summed; likewise
  safety::ArmVector q;         ///< joints of the last result, m, rad
  /// theta_i: angle of each tube at its end in the torsion-free frame, rad. The shape follows from it and beta.
  TubeVector end_angle = TubeVector::Zero();
  /// d theta / d beta and d theta / d alpha of the last result; identity rows for tubes that the arm does not have.
  TubeMatrix by_translation = TubeMatrix::Zero(), by_rotation = TubeMatrix::Identity();
  /// Wrench of the last result, arm base frame, N and N m.
  Eigen::Matrix<double, 6, 1> load = Eigen::Matrix<double, 6, 1>::Zero();
  /// Arm base frame <- torsion-free frame of tube 1's end; only defined under a load.
  Eigen::Matrix3d end_frame = Eigen::Matrix3d::Identity();
  /// Rotation of that frame by beta and by alpha (arm base frame), and derivatives of end_angle and of the frame by the
  /// wrench; likewise.
  Eigen::Matrix<double, 3, kMaxTubes> turn_by_translation = Eigen::Matrix<double, 3, kMaxTubes>::Zero(),
                                      turn_by_rotation = Eigen::Matrix<double, 3, kMaxTubes>::Zero();
  Eigen::Matrix<double, kMaxTubes + 3, 6> by_load = Eigen::Matrix<double, kMaxTubes + 3, 6>::Zero();

  /// Full turns of the end of tube i (from 0) relative to the end of tube 1; the remainder is in [-pi, pi). They
  /// identify the branch: results for the same joints are on the same branch if these numbers agree for all tubes.
  int winding(int tube) const noexcept;
};

}  // namespace tandem::kinematics
