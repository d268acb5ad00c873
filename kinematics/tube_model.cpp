// SPDX-License-Identifier: Apache-2.0
#include "kinematics/tube_model.h"

#include <stdexcept>

#include "kinematics/compliant_model.h"
#include "kinematics/rigid_model.h"

namespace tandem::kinematics {

TubeModel::TubeModel(ConcentricTubeArm arm) : arm_(std::move(arm)) { checkArm(arm_); }

int TubeModel::sections(const JointsRef& q, BodySections& sections) const noexcept {
  const int n = arm_.tubeCount();
  double end = 0.0;
  Gradient by_joints = Gradient::Zero(2 * n);
  for (int i = n - 1; i >= 0; --i) {
    const Tube& tube = arm_.tubes[static_cast<std::size_t>(i)];
    if (const double own = q[i] + tube.length(); own > end) {
      end = own;
      by_joints = Gradient::Unit(2 * n, i);
    }
    sections[static_cast<std::size_t>(n - 1 - i)] = {end, 0.5 * tube.outer_diameter, by_joints};
  }
  return n;
}

double TubeModel::helixAngle(const JointsRef& q, int body) const noexcept {
  return arm_.tubes[static_cast<std::size_t>(body)].helixAngle(-q[body]);
}

std::unique_ptr<TubeModel> makeArmModel(const std::string& name, const ConcentricTubeArm& arm) {
  if (name == "rigid")
    return std::make_unique<RigidModel>(arm);
  if (name == "compliant")
    return std::make_unique<CompliantModel>(arm);
  throw std::invalid_argument("unknown kinematic model '" + name + "', expected: rigid, compliant");
}

}  // namespace tandem::kinematics
