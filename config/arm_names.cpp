// SPDX-License-Identifier: Apache-2.0
#include "config/arm_names.h"

#include "config/key_table.h"
#include "control/conflict.h"

namespace tandem::config {

std::optional<std::size_t> findArm(const Robot& robot, const std::string& name) {
  for (std::size_t k = 0; k < robot.arms.size(); ++k) {
    if (robot.arms[k].name == name || robot.arms[k].name == "arm_" + name)
      return k;
  }
  const int k = indexOfLetter(name);
  return k >= 0 && static_cast<std::size_t>(k) < robot.arms.size() ? std::optional<std::size_t>(k) : std::nullopt;
}

std::vector<std::string> armList(const Robot& robot) {
  std::vector<std::string> names;
  for (const Arm& arm : robot.arms)
    names.push_back(arm.name);
  return names;
}

std::vector<std::string> shortArmNames(const Robot& robot) {
  std::vector<std::string> names = armList(robot);
  for (std::string& name : names)
    name = name.starts_with("arm_") ? name.substr(4) : name;
  return names;
}

int indexOfLetter(const std::string& name) {
  if (name.size() != 1)
    return planning::kNamedArm;
  const int index = name[0] - (name[0] < 'a' ? '0' : 'a');
  return index >= 0 && index < safety::kMaxArms ? index : planning::kNamedArm;
}

std::string nameOrLetter(const std::string& name, int arm) { return name.empty() ? control::armLetter(arm) : name; }

std::string findArms(planning::TrajectorySpec& trajectory, const Robot& robot) {
  const std::vector<std::string> names = shortArmNames(robot);
  const auto resolve = [&](int& index, std::string& name) -> std::string {
    const auto found = name.empty() ? std::optional<std::size_t>(index) : findArm(robot, name);
    if (!found || *found >= names.size())
      return "found arm " + nameOrLetter(name, index) + ", expected " +
             (names.size() == 1 ? names[0] + ", the only arm of this robot; write tasks: [{tip: " + names[0] + "}]"
                                : join(names, " or "));
    index = static_cast<int>(*found);
    name = names[*found];
    return {};
  };
  std::string wrong = resolve(trajectory.arm, trajectory.arm_name);
  if (wrong.empty() && trajectory.hasRelative())
    wrong = resolve(trajectory.other_arm, trajectory.other_arm_name);
  for (planning::FurtherTask& task : trajectory.further) {
    if (wrong.empty())
      wrong = resolve(task.arm, task.arm_name);
    if (wrong.empty() && task.relative())
      wrong = resolve(task.other_arm, task.other_arm_name);
  }
  return wrong.empty() ? trajectory.wrongArms(static_cast<int>(names.size())) : wrong;
}

std::string armNames(const Robot& robot) { return join(armList(robot)); }

}  // namespace tandem::config
