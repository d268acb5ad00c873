// SPDX-License-Identifier: Apache-2.0
#include "services/console/shapes.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "robots/display_shape.h"
#include "services/console/access.h"
#include "services/console/numbers.h"

namespace tandem::console {
namespace {

double lengthOrAngle(const std::string& name, std::string_view text) {
  return numberOf(name, text, "a finite number, m or rad");
}

}  // namespace

std::vector<double> Shapes::jointsOf(std::string_view text) const {
  if (robot_.models().empty())
    throw std::invalid_argument("joints: the arms of this robot have no shape without the other arms");
  std::vector<double> q;
  std::istringstream parts{std::string(text)};
  for (std::string part; std::getline(parts, part, ',');)
    q.push_back(lengthOrAngle("joints", part));
  if (static_cast<int>(q.size()) != robot_.jointCount())
    throw std::invalid_argument("joints: found " + std::to_string(q.size()) + " numbers, expected " +
                                std::to_string(robot_.jointCount()));
  return q;
}

std::string Shapes::at(std::string_view joints) const {
  const std::vector<double> q = jointsOf(joints);
  nlohmann::json arms = nlohmann::json::array();
  std::vector<kinematics::ShapePoint> buffer;
  for (int k = 0; k < robot_.armCount(); ++k) {
    robots::DisplayShape shape;
    kinematics::Branch branch;
    const Eigen::VectorXd own = Eigen::VectorXd::Map(q.data() + robot_.offset(k), robot_.size(k));
    if (displayShape(*robot_.models()[static_cast<std::size_t>(k)], own, branch, buffer, shape))
      arms.push_back({{"points", shape.points}, {"tubes", shape.tubes}, {"outer_radius", shape.outer_radius}});
    else
      arms.push_back(nullptr);
  }
  return nlohmann::json{{"arms", arms}}.dump();
}

Shapes::Span Shapes::spanIn(std::string_view query) {
  return {parameterOf(query, "joints"), parameterOf(query, "joint"), parameterOf(query, "lower"),
          parameterOf(query, "upper")};
}

std::string Shapes::span(const Span& span) const {
  const std::vector<double> q = jointsOf(span.joints);
  const double index = lengthOrAngle("joint", span.joint);
  const double lower = lengthOrAngle("lower", span.lower), upper = lengthOrAngle("upper", span.upper);
  if (index != std::floor(index) || index < 0.0 || index >= robot_.jointCount())
    throw std::invalid_argument("joint: found " + std::string(span.joint) + ", expected a whole number from 0 to " +
                                std::to_string(robot_.jointCount() - 1));
  if (lower > upper)
    throw std::invalid_argument("lower: found " + std::string(span.lower) + ", expected at most upper, " +
                                std::string(span.upper));
  const int joint = static_cast<int>(index);
  int arm = 0;
  while (joint >= robot_.offset(arm) + robot_.size(arm))
    ++arm;
  Eigen::VectorXd own = Eigen::VectorXd::Map(q.data() + robot_.offset(arm), robot_.size(arm));
  nlohmann::json tips = nlohmann::json::array();
  kinematics::Branch branch;
  for (int k = 0; k < kSpanPoints; ++k) {
    own[joint - robot_.offset(arm)] = lower + (upper - lower) * k / (kSpanPoints - 1);
    kinematics::Tip tip;
    if (robot_.models()[static_cast<std::size_t>(arm)]->tip(own, branch, tip) == kinematics::ModelStatus::kOk) {
      const Eigen::Vector3d at = tip.pose.translation();
      tips.push_back({at.x(), at.y(), at.z()});
    } else {
      tips.push_back(nullptr);
    }
  }
  return nlohmann::json{{"tips", tips}}.dump();
}

}  // namespace tandem::console
