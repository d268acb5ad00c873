// SPDX-License-Identifier: Apache-2.0
/** @file Elastic catheter: Cosserat rods in place of circular arcs. */
#pragma once

#include <string_view>

#include "kinematics/catheter/arm.h"
#include "kinematics/cosserat/rod_model.h"

namespace tandem::kinematics::catheter {

/// Quantity of the actuator that is constant at a given joint `bend` while the load changes.
enum class Actuation {
  kDisplacement,  ///< displacement of the pull wires, bend times their offset: the actuator is at standstill
  kTension        ///< tension of the pull wires: the one that bends the unloaded catheter by `bend`
};
std::string_view nameOf(Actuation actuation);

/** A catheter with the stiffness of its two ends. The tension of the pull wires is an intrinsic curvature of the distal
 * end, bend / L without a load.
 *
 * The wires are an antagonistic pair that stays under tension; in the passive end they run along its axis, so that its
 * deformation does not change their length. A load moves tension from one wire to the other: their sum, and with it the
 * axial compression of the catheter, is constant. */
struct ElasticArm {
  Arm arm;
  cosserat::Section proximal;  ///< its length and intrinsic curvature are of no account
  cosserat::Section distal;    ///< as long as arm.bending_length; its own length is of no account
  Actuation actuation = Actuation::kTension;
  /// E I / (k r^2 L) of the distal end and of wires with the stiffness k (N/m) at the offset r; 0: inextensible.
  double wire_elasticity = 0.0;
};

/** Adds a bend in the direction of `share` (of inputs 0 and 1 of rodOf()) to a rod's inputs, as the arm is actuated. */
void actuate(const ElasticArm& arm, double bend, const cosserat::Inputs& share, cosserat::RodInput& input);

/// The rod of a catheter: section 0 is as long as the insertion, section 1 bends about y, then x, by inputs 0 and 1, in
/// rad; without a tool.
cosserat::Rod rodOf(const ElasticArm& arm);

/** A catheter under a wrench at its tool tip; ConstantCurvature where there is none. Allocates nothing but in shape().
 */
class ElasticCatheter {
 public:
  /// @throw std::invalid_argument as checkArm() and cosserat::checkRod() do, or for a wire elasticity below zero.
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
