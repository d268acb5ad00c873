// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>
#include <utility>

#include "kinematics/tube_model.h"
#include "robots/types.h"

namespace tandem::robots {
namespace {

class TubeType final : public RobotType {
 public:
  std::string description() const override { return "concentric tubes"; }
  bool has(Capability capability) const noexcept override { return capability != Capability::kCommonPath; }

  ArmAppearance appearance(const config::Robot& robot, int number) const override {
    const config::Arm& arm = robot.arms[static_cast<std::size_t>(number)];
    ArmAppearance appearance{"concentric_tube", {}, {}, arm.model.base, arm.model.tool};
    for (const kinematics::Tube& tube : arm.model.tubes)
      appearance.tubes.push_back({"tube " + std::to_string(appearance.tubes.size() + 1), tube.length(),
                                  tube.outer_diameter / 2, tube.inner_diameter / 2, tube.sections});
    for (const auto& [letter, motion] : {std::pair("β", "translation of "), std::pair("α", "rotation of ")}) {
      for (std::size_t i = 0; i < appearance.tubes.size(); ++i) {
        const std::string& tube = appearance.tubes[i].name;
        appearance.joints.push_back({letter + std::to_string(i + 1), motion + tube, tube});
      }
    }
    return appearance;
  }

  std::unique_ptr<kinematics::ArmModel> makeModel(const config::Robot& robot,
                                                  int arm,
                                                  const std::string& name) const override {
    if (name != "rigid" && name != elasticModel())
      throw std::invalid_argument("model: found '" + name + "', expected rigid or compliant for concentric tubes");
    return kinematics::makeArmModel(name, robot.arms[static_cast<std::size_t>(arm)].model);
  }

  std::string elasticModel() const override { return "compliant"; }
};

}  // namespace

const RobotType& tubeType() {
  static const TubeType type;
  return type;
}

}  // namespace tandem::robots
