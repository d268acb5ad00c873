// SPDX-License-Identifier: Apache-2.0
#include "robots/appearance.h"

#include <algorithm>
#include <utility>

namespace tandem::robots {
namespace {

ArmAppearance ofTubes(const config::Arm& arm) {
  ArmAppearance appearance{"concentric_tube", {}, {}, arm.model.base, arm.model.tool};
  for (const kinematics::Tube& tube : arm.model.tubes)
    appearance.tubes.push_back({"tube " + std::to_string(appearance.tubes.size() + 1), tube.length(),
                                tube.outer_diameter / 2, tube.inner_diameter / 2, tube.sections});
  for (const auto& [letter, motion] : {std::pair("β", "translation of "), std::pair("α", "rotation of ")}) {
    for (std::size_t i = 0; i < appearance.tubes.size(); ++i) {
      const std::string& tube = appearance.tubes[i].name;
      appearance.joints.push_back({letter + std::to_string(i + 1), motion + tube, tube});
    }
  }
  return appearance;
}

ArmAppearance ofCatheter(const config::CatheterArm& arm) {
  const kinematics::catheter::Arm& model = arm.model.arm;
  const double length = arm.limits.joints[0].upper + model.bending_length + std::max(0.0, model.tool.translation().z());
  return {"catheter",
          {{"catheter", length, arm.outer_diameter / 2, 0.0, {}}},
          {{"insertion", "insertion", "insertion"}, {"roll", "roll", "roll"}, {"bend", "bend", "bend"}},
          model.base,
          model.tool};
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
