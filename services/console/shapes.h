// SPDX-License-Identifier: Apache-2.0
/** @file Bodies of the arms at given joints, for the preview of a trajectory. */
#pragma once

#include <string>
#include <string_view>

#include "robots/robot_model.h"

namespace tandem::console {

class Shapes {
 public:
  /// @param model  "rigid" or "compliant"
  Shapes(const config::Robot& robot, const std::string& model) : robot_(robot, model) {}

  /// JSON with points (m, robot base frame), outermost tubes and their radii (m) of each arm; null for an arm whose
  /// model has no solution there. @param joints  of all arms, one arm after the other, m and rad, separated by commas
  /// @throw std::invalid_argument that names what was found and expected
  std::string at(std::string_view joints) const;

 private:
  robots::RobotModel robot_;
};

}  // namespace tandem::console
