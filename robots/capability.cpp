// SPDX-License-Identifier: Apache-2.0
#include "robots/capability.h"

#include "robots/robot_type.h"

namespace tandem::robots {
namespace {

/// "concentric tubes or catheters": the types with this capability.
std::string typesWith(Capability capability) {
  std::string types;
  for (const RobotType* type : robotTypes()) {
    if (type->has(capability))
      types += (types.empty() ? "" : " or ") + type->description();
  }
  return types;
}

std::string reason(Capability capability, const std::string& found) {
  switch (capability) {
    case Capability::kTips:
      return found + " move a common object; their tips cannot be commanded one by one";
    case Capability::kCommonPath:
      return "each tip of " + found + " follows a reference of its own";
    case Capability::kComputation:
      return "planning before the motion is not available for " + found;
    case Capability::kStability:
      return "elastic stability is not computed for " + found;
  }
  return {};
}

}  // namespace

bool has(const config::Robot& robot, Capability capability) { return typeOf(robot).has(capability); }

std::string refusal(const config::Robot& robot, Capability capability) {
  if (has(robot, capability))
    return {};
  const std::string found = typeOf(robot).description();
  return "robot: found the " + found + " of " + robot.file.string() + ", expected " + typesWith(capability) + ": " +
         reason(capability, found);
}

}  // namespace tandem::robots
