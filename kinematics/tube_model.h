// SPDX-License-Identifier: Apache-2.0
/** @file Base class of the kinematic models of concentric tubes. */
#pragma once

#include "kinematics/arm_model.h"

namespace tandem::kinematics {

/** A model of one arm of concentric tubes. */
class TubeModel : public ArmModel {
 public:
  const ConcentricTubeArm& arm() const noexcept { return arm_; }
  int jointCount() const noexcept override { return arm_.jointCount(); }
  const Eigen::Isometry3d& base() const noexcept override { return arm_.base; }
  /// One section for each tube, from the outermost; empty if a tube ends behind the one around it.
  int sections(const JointsRef& q, BodySections& sections) const noexcept override;
  double helixAngle(const JointsRef& q, int body) const noexcept override;

 protected:
  /// @throw std::invalid_argument as checkArm() does.
  explicit TubeModel(ConcentricTubeArm arm);
  ConcentricTubeArm arm_;
};

/** Creates a model by name: "rigid" or "compliant".
 * @throw std::invalid_argument for another name, or an arm that checkArm() refuses. */
std::unique_ptr<TubeModel> makeArmModel(const std::string& name, const ConcentricTubeArm& arm);

}  // namespace tandem::kinematics
