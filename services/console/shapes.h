// SPDX-License-Identifier: Apache-2.0
/** @file Bodies and tips of the arms at given joints, for previews. */
#pragma once

#include <string>
#include <string_view>
#include <vector>

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

  /// One joint that moves alone.
  struct Span {
    std::string_view joints;        ///< of all arms, as in at()
    std::string_view joint;         ///< index among them, counts from 0
    std::string_view lower, upper;  ///< m or rad
  };
  /// @param query  joints=...&joint=...&lower=...&upper=...; outlives the result
  static Span spanIn(std::string_view query);
  static constexpr int kSpanPoints = 33;
  /// JSON with `tips`: positions (m, robot base frame) of the tip of the joint's arm at kSpanPoints places of the
  /// joint, evenly spaced from lower to upper; null where the model has no solution.
  /// @throw std::invalid_argument that names what was found and expected
  std::string span(const Span& span) const;

 private:
  /// @throw std::invalid_argument
  std::vector<double> jointsOf(std::string_view text) const;

  robots::RobotModel robot_;
};

}  // namespace tandem::console
