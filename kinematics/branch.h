// SPDX-License-Identifier: Apache-2.0
/** @file Branch: identifies one of several equilibria of an elastic arm. */
#pragma once

#include <array>

#include "kinematics/concentric_tube.h"
#include "safety/dimensions.h"

namespace tandem::kinematics {

/** The memory of an arm that is followed along a joint path.
 *
 * For the same joints elastic tubes may have several stable equilibria; where a real arm is depends on how it came
 * there. A model that is given the Branch of its last answer goes on from it, and the Branch then holds the new one. A
 * new Branch asks for a cold start: the equilibrium that the untwisted tubes grow into as their torsional stiffness
 * falls from infinite to the real one. Rigid models have one answer and leave a Branch as it is.
 */
struct Branch {
  bool known = false;    ///< there was an answer
  bool snapped = false;  ///< on the way to the last answer the followed equilibrium ended, and the arm fell to another
  safety::ArmVector q;   ///< joints of the last answer, m, rad
  /// theta_i: angle of each tube at its end in the torsion-free frame, rad. With beta it determines the shape.
  TubeVector end_angle = TubeVector::Zero();
  /// d theta / d beta and d theta / d alpha of the last answer; identity rows for tubes that the arm does not have.
  TubeMatrix by_translation = TubeMatrix::Zero(), by_rotation = TubeMatrix::Identity();
  /// Wrench of the last answer, arm base frame, N and N m.
  Eigen::Matrix<double, 6, 1> load = Eigen::Matrix<double, 6, 1>::Zero();
  /// Arm base frame <- torsion-free frame of tube 1's end; defined under a load only.
  Eigen::Matrix3d end_frame = Eigen::Matrix3d::Identity();

  /// Full turns by which the end of tube i (from 0) is wound past the end of tube 1, so that the rest lies in [-pi,
  /// pi): the name of the branch. Answers for the same joints are on the same branch if these numbers agree for all
  /// tubes.
  int winding(int tube) const noexcept;
};

}  // namespace tandem::kinematics
