// SPDX-License-Identifier: Apache-2.0
#include "robots/limit_description.h"

#include "config/arm_names.h"
#include "robots/robot_type.h"

namespace tandem::robots {

std::string describeLimit(const config::Robot& robot, const control::NamedLimit& limit) {
  using enum control::LimitKind;
  std::string words = control::describe(limit, config::shortArmNames(robot));
  if (limit.arm < 0 || limit.arm >= static_cast<int>(robot.arms.size()))
    return words;
  const bool turn = limit.kind == kRotationVelocity || limit.kind == kRotation || limit.kind == kRotationStep;
  const safety::ArmLimits& limits = robot.arms[static_cast<std::size_t>(limit.arm)].limits;
  const std::string tube = "tube " + std::to_string(limit.tube);
  const std::size_t at = words.find(tube);
  for (int j = 0, count = 0; at != std::string::npos && j < limits.jointCount(); ++j) {
    if (limits.isTranslation(j) != turn && ++count == limit.tube) {
      const ArmAppearance arm = typeOf(robot).appearance(robot, limit.arm);
      return words.replace(at, tube.size(), arm.joints[static_cast<std::size_t>(j)].part);
    }
  }
  return words;
}

}  // namespace tandem::robots
