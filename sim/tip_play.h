// SPDX-License-Identifier: Apache-2.0
/** @file Lateral displacement of an arm's tip within the clearance between its tubes. */
#pragma once

#include "kinematics/arm_model.h"

namespace tandem::sim {

/** Position of the tip inside the clearance of the tubes.
 *
 * In a bore with diametral clearance c, tube i can shift by c / 2 to each side and tilt by c / L, with one end at
 * either wall; L is the length of the last section of the tube around it, which guides it. At the tip, a length l_i
 * beyond the end of that tube, this is at most
 *
 *   D = sum over the pairs of neighbouring tubes of c (1 / 2 + l_i / L_i),   c = clearance + ovality / 2,
 *
 * where an oval bore, of the same mean diameter, is wider by half its ovality (largest less smallest diameter) in one
 * direction. Inside this disc the tip stays at its position in space while the arm moves (lost motion): the lateral
 * offset from the pose of the model is that of the step before, less the lateral motion of the model's tip, cut off at
 * D. An upper bound: bent tubes press on a wall and use part of it. The orientation keeps the model's value; the tilt
 * is below D / l. Nothing after construction allocates. */
class TipPlay {
 public:
  /// @param arm of the plant, for the sections' lengths; @param clearance diametral, m; @param ovality m
  TipPlay(const kinematics::ConcentricTubeArm& arm, double clearance, double ovality);

  /// Reset of the joints: the next position is in the middle.
  void restart() noexcept { known_ = false; }
  /// Largest lateral offset at joints q, m.
  double radius(const safety::ArmVector& q) const noexcept;
  /// Moves the model's tip `pose` at joints q to its place inside the play.
  void apply(const safety::ArmVector& q, Eigen::Isometry3d& pose) noexcept;

 private:
  kinematics::TubeVector length_ = kinematics::TubeVector::Zero(), guide_ = kinematics::TubeVector::Ones();
  int tubes_;
  double clearance_;
  bool known_ = false;
  Eigen::Vector3d tip_ = Eigen::Vector3d::Zero();  ///< of the step before, robot base frame, m
};

}  // namespace tandem::sim
