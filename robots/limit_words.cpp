// SPDX-License-Identifier: Apache-2.0
#include "robots/limit_words.h"

#include "config/arm_names.h"

namespace tandem::robots {

std::string describeLimit(const config::Robot& robot, const control::NamedLimit& limit) {
  using enum control::LimitKind;
  std::string words = control::describe(limit, config::shortArmNames(robot));
  if (!robot.catheters)
    return words;
  const bool turn = limit.kind == kRotationVelocity || limit.kind == kRotation || limit.kind == kRotationStep;
  const std::string tube = "tube " + std::to_string(limit.tube);
  if (const std::size_t at = words.find(tube); at != std::string::npos)
    words.replace(at, tube.size(), !turn ? "insertion" : limit.tube == 1 ? "roll" : "bend");
  return words;
}

}  // namespace tandem::robots
