// SPDX-License-Identifier: Apache-2.0
#include "services/client/lost_protections.h"

#include <algorithm>
#include <map>

#include "hal/drives/protections.h"

namespace tandem::client {

nlohmann::ordered_json lostProtections(const config::Robot& robot, const dds::HalStatus& hal) {
  std::map<std::uint16_t, std::string> joints;
  for (std::size_t k = 0; k < std::min<std::size_t>(hal.arm_count, robot.arms.size()); ++k) {
    for (std::size_t j = 0; j < robot.arms[k].joint_names.size(); ++j) {
      std::string& text = joints[hal.axis_lost[dds::jointIndex(static_cast<int>(k), static_cast<int>(j))]];
      text += (text.empty() ? "" : ", ") + robot.arms[k].name + " " + robot.arms[k].joint_names[j];
    }
  }
  auto json = nlohmann::ordered_json::array();
  for (const auto& [lost, names] : joints) {
    if (lost != 0)
      json.push_back(
          {{"lost", hal::describeProtections(lost)}, {"joints", joints.size() == 1 ? std::string("all") : names}});
  }
  return json;
}

std::string describeLost(const nlohmann::ordered_json& lost, const std::string& indent) {
  std::string text;
  for (const auto& group : lost)
    text +=
        indent + "drives (" + group["joints"].get<std::string>() + ") lack " + group["lost"].get<std::string>() + '\n';
  return text;
}

}  // namespace tandem::client
