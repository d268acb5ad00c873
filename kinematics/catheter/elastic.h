// SPDX-License-Identifier: Apache-2.0
/** @file Elastic catheter: Cosserat rods in place of circular arcs. */
#pragma once

#include "kinematics/catheter/arm.h"
#include "kinematics/cosserat/rod_model.h"

namespace tandem::kinematics::catheter {

/** A catheter with the stiffness of its two ends. Bending is what the knob commands: an intrinsic curvature bend / L of
 * the distal end, about which it is as stiff as its tendons and wall leave it. */
struct ElasticArm {
  Arm arm;
  cosserat::Section proximal;  ///< its length and intrinsic curvature are of no account
  cosserat::Section distal;    ///< as long as arm.bending_length; its own length is of no account
};

/// The rod of a catheter: section 0 is as long as the insertion, section 1 bends about y, then x, by inputs 0 and 1, in
/// rad; without a tool.
cosserat::Rod rodOf(const ElasticArm& arm);

/** A catheter under a wrench at its tool tip; ConstantCurvature where there is none. Allocates nothing but in shape().
 */
class ElasticCatheter {
 public:
  /// @throw std::invalid_argument as checkArm() and cosserat::checkRod() do.
  explicit ElasticCatheter(const ElasticArm& arm);
  const ElasticArm& arm() const { return arm_; }

  /// Tip, Jacobian (6 x 3, of insertion, roll, bend) and compliance in the robot base frame.
  /// @param wrench  at the tool tip, keeps its direction in the robot base frame, N and N m
  ModelStatus tip(const JointsRef& q, const Wrench& wrench, cosserat::RodBranch& branch, LoadedTip& tip) const noexcept;

  ModelStatus shape(const JointsRef& q,
                    const Wrench& wrench,
                    cosserat::RodBranch& branch,
                    int points,
                    std::vector<cosserat::RodPoint>& shape) const;

 private:
  cosserat::RodInput inputOf(const JointsRef& q, const Wrench& wrench) const;

  ElasticArm arm_;
  cosserat::RodModel model_;
};

}  // namespace tandem::kinematics::catheter
