// SPDX-License-Identifier: Apache-2.0
#include "robots/appearance.h"

#include <algorithm>

namespace tandem::robots {
namespace {

ArmAppearance ofTubes(const config::Arm& arm) {
  ArmAppearance appearance{"concentric_tube", {}, arm.model.base, arm.model.tool};
  for (const kinematics::Tube& tube : arm.model.tubes)
    appearance.tubes.push_back({tube.length(), tube.outer_diameter / 2, tube.inner_diameter / 2, tube.sections});
  return appearance;
}

ArmAppearance ofCatheter(const config::CatheterArm& arm) {
  const kinematics::catheter::Arm& model = arm.model.arm;
  const double length = arm.limits.joints[0].upper + model.bending_length + std::max(0.0, model.tool.translation().z());
  return {"catheter", {{length, arm.outer_diameter / 2, 0.0, {}}}, model.base, model.tool};
}

}  // namespace

ArmAppearance appearanceOf(const config::Robot& robot, int arm) {
  const auto k = static_cast<std::size_t>(arm);
  if (!robot.catheters)
    return ofTubes(robot.arms[k]);
  return ofCatheter(robot.catheters->arms[static_cast<std::size_t>(config::armsInOrder(*robot.catheters)[k])]);
}

const config::HeldObject* heldObject(const config::Robot& robot) noexcept {
  return robot.catheters && robot.catheters->object ? &*robot.catheters->object : nullptr;
}

}  // namespace tandem::robots
