// SPDX-License-Identifier: Apache-2.0
#include "services/client/unconfirmed_positions.h"

#include <algorithm>

#include "hal/position_memory.h"
#include "services/runtime/joint_text.h"

namespace tandem::client {
nlohmann::ordered_json unconfirmedPositions(const config::Robot& robot,
                                            const dds::HalStatus& hal,
                                            const dds::ActuationState& state) {
  auto json = nlohmann::ordered_json::array();
  for (std::size_t k = 0; k < std::min<std::size_t>(hal.arm_count, robot.arms.size()); ++k) {
    const config::Arm& arm = robot.arms[k];
    for (std::size_t j = 0; j < arm.joint_names.size(); ++j) {
      const std::size_t i = dds::jointIndex(static_cast<int>(k), static_cast<int>(j));
      const std::string joint = arm.name + " " + arm.joint_names[j];
      const auto phase = static_cast<idl::AxisPhase>(hal.axis_phase[i]);
      const bool translation = arm.limits.isTranslation(static_cast<int>(j));
      if (phase == idl::AxisPhase::kUnmeasured)
        json.push_back(
            {{"joint", joint},
             {"measured", nullptr},
             {"expected", nullptr},
             {"tolerance", hal.axis_jump_tolerance[i]},
             {"text", joint + ": position not measured: measure the joint, then tandem home --arm " + arm.name +
                          " --measured " + arm.joint_names[j] + (translation ? "=MM" : "=DEGREES")}});
      if (phase != idl::AxisPhase::kUnconfirmed)
        continue;
      const auto last = static_cast<hal::LastPosition>(hal.axis_last[i]);
      const bool known = last == hal::LastPosition::kKnown;
      const double expected = hal.axis_last_position[i], tolerance = hal.axis_jump_tolerance[i];
      nlohmann::ordered_json entry{{"joint", joint}, {"measured", state.position[i]}, {"expected", nullptr}};
      if (known)
        entry["expected"] = expected;
      entry["tolerance"] = tolerance;
      entry["text"] =
          joint + ": position not confirmed: " + runtime::jointText(state.position[i], translation) + " measured; " +
          (known ? "expected " + runtime::jointText(expected, translation) + ", as it was last, or at most " +
                       runtime::jointText(tolerance, translation) + " away"
                 : "nothing to compare it with: " + std::string(hal::reasonOf(last)));
      json.push_back(entry);
    }
  }
  return json;
}

std::string describeUnconfirmed(const nlohmann::ordered_json& unconfirmed, const std::string& indent) {
  std::string text;
  for (const auto& entry : unconfirmed)
    text += indent + entry["text"].get<std::string>() + '\n';
  return text;
}

}  // namespace tandem::client
