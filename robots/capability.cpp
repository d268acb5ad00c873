// SPDX-License-Identifier: Apache-2.0
#include "robots/capability.h"

namespace tandem::robots {

bool has(const config::Robot& robot, Capability capability) noexcept {
  return (capability == Capability::kCommonPath) == (robot.catheters != nullptr);
}

std::string refusal(const config::Robot& robot, Capability capability) {
  if (has(robot, capability))
    return {};
  const std::string found = "robot: found the " + std::string(robot.catheters ? "catheters" : "concentric tubes") +
                            " of " + robot.file.string() + ", expected ";
  switch (capability) {
    case Capability::kTips:
      return found + "concentric tubes: catheters move one thing together, not each its tip";
    case Capability::kCommonPath:
      return found + "catheters: each tip of concentric tubes follows a trajectory of its own";
    case Capability::kComputation:
      return found + "concentric tubes: planning judges a path of catheters when it is started";
  }
  return found + "another type";
}

}  // namespace tandem::robots
