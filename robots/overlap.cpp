// SPDX-License-Identifier: Apache-2.0
#include "robots/overlap.h"

#include <array>
#include <cstdio>

namespace tandem::robots {
namespace {

/// "tube 3 of arm_a": the outermost tube at arc length s; the arm's name for other types.
std::string partAt(const config::Arm& arm, const Eigen::VectorXd& q, double s) {
  constexpr double kAtEnd = 1e-9;  // m, rounding at a tube's end
  int outermost = -1;
  for (int i = 0; i < arm.model.tubeCount(); ++i) {
    if (arm.model.tubes[static_cast<std::size_t>(i)].length() + q[i] + kAtEnd >= s)
      outermost = i;
  }
  return outermost < 0 ? arm.name : "tube " + std::to_string(outermost + 1) + " of " + arm.name;
}

}  // namespace

std::vector<std::optional<kinematics::Body>> bodiesAt(const RobotModel& model,
                                                      const std::vector<Eigen::VectorXd>& joints) {
  std::vector<std::optional<kinematics::Body>> bodies(model.models().size());
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    kinematics::Branch branch;
    kinematics::Body body;
    if (kinematics::makeBody(*model.models()[k], joints[k], branch, false, body) == kinematics::ModelStatus::kOk)
      bodies[k] = std::move(body);
  }
  return bodies;
}

std::vector<ArmDistance> armDistances(const std::vector<std::optional<kinematics::Body>>& bodies) {
  std::vector<ArmDistance> distances;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    for (std::size_t j = i + 1; j < bodies.size(); ++j) {
      if (bodies[i] && bodies[j])
        distances.push_back({i, j, kinematics::clearance(*bodies[i], *bodies[j])});
    }
  }
  return distances;
}

std::vector<std::string> describeOverlaps(const config::Robot& robot,
                                          const RobotModel& model,
                                          const std::vector<Eigen::VectorXd>& joints) {
  std::vector<std::string> texts;
  for (const auto& [i, j, least] : armDistances(bodiesAt(model, joints))) {
    if (least.distance >= 0.0)
      continue;
    std::array<char, 80> depth{}, place{};
    std::snprintf(depth.data(), depth.size(), " overlap by %.3g mm: ", -1e3 * least.distance);
    std::snprintf(place.data(), place.size(), ", z = %.0f mm", 1e3 * least.place_a.z());
    texts.push_back(robot.arms[i].name + " and " + robot.arms[j].name + depth.data() +
                    partAt(robot.arms[i], joints[i], least.s_a) + ", " + partAt(robot.arms[j], joints[j], least.s_b) +
                    place.data());
  }
  return texts;
}

std::vector<std::string> describeHomeOverlaps(const config::Robot& robot, const std::string& model) {
  std::vector<Eigen::VectorXd> home;
  for (const config::Arm& arm : robot.arms)
    home.push_back(arm.home);
  std::vector<std::string> texts = describeOverlaps(robot, RobotModel(robot, model), home);
  for (std::string& text : texts)
    text.insert(0, "at home ");
  return texts;
}

}  // namespace tandem::robots
