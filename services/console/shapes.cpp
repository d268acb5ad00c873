// SPDX-License-Identifier: Apache-2.0
#include "services/console/shapes.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "robots/display_shape.h"

namespace tandem::console {
namespace {

std::vector<double> numbersOf(std::string_view text) {
  std::vector<double> numbers;
  std::istringstream parts{std::string(text)};
  for (std::string part; std::getline(parts, part, ',');) {
    char* end = nullptr;
    const double number = std::strtod(part.c_str(), &end);
    if (part.empty() || *end != '\0' || !std::isfinite(number))
      throw std::invalid_argument("joints: found '" + part.substr(0, 40) + "', expected a finite number, m or rad");
    numbers.push_back(number);
  }
  return numbers;
}

}  // namespace

std::string Shapes::at(std::string_view joints) const {
  if (robot_.models().empty())
    throw std::invalid_argument("joints: the arms of this robot have no shape without the other arms");
  const std::vector<double> q = numbersOf(joints);
  if (static_cast<int>(q.size()) != robot_.jointCount())
    throw std::invalid_argument("joints: found " + std::to_string(q.size()) + " numbers, expected " +
                                std::to_string(robot_.jointCount()));
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

}  // namespace tandem::console
