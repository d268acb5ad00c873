// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "robots/catheters.h"
#include "robots/types.h"

namespace tandem::robots {
namespace {

const config::CooperativeRobot& fileOf(const config::Robot& robot) {
  return static_cast<const config::CooperativeRobot&>(*robot.data);
}

class CatheterType final : public RobotType {
 public:
  std::string description() const override { return "catheters"; }
  bool has(Capability capability) const noexcept override { return capability == Capability::kCommonPath; }
  idl::Model model(const std::string&) const override { return idl::Model::kElastic; }

  ArmAppearance appearance(const config::Robot& robot, int number) const override {
    const config::CooperativeRobot& file = fileOf(robot);
    const int in_file = config::armsInOrder(file)[static_cast<std::size_t>(number)];
    const config::CatheterArm& arm = file.arms[static_cast<std::size_t>(in_file)];
    const kinematics::catheter::Arm& model = arm.model.arm;
    const double length =
        arm.limits.joints[0].upper + model.bending_length + std::max(0.0, model.tool.translation().z());
    return {"catheter",
            {{"catheter", length, arm.outer_diameter / 2, 0.0, {}}},
            {{"insertion", "insertion", "insertion"}, {"roll", "roll", "roll"}, {"bend", "bend", "bend"}},
            model.base,
            model.tool};
  }

  std::unique_ptr<Mechanism> makeMechanism(const config::Robot& robot) const override {
    if (fileOf(robot).object)
      return std::make_unique<GraspedObjectMechanism>(fileOf(robot));
    return std::make_unique<AssistedMechanism>(fileOf(robot));
  }

  const config::GraspedObject* graspedObject(const config::Robot& robot) const noexcept override {
    return fileOf(robot).object ? &*fileOf(robot).object : nullptr;
  }
};

}  // namespace

const RobotType& catheterType() {
  static const CatheterType type;
  return type;
}

}  // namespace tandem::robots
