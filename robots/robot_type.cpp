// SPDX-License-Identifier: Apache-2.0
#include "robots/robot_type.h"

#include <stdexcept>

#include "robots/mechanism.h"
#include "robots/types.h"

namespace tandem::robots {
namespace {

struct Entry {
  const char* kind;  ///< config::Robot::type
  const RobotType& type;
};

const std::vector<Entry>& entries() {
  static const std::vector<Entry> all{{"robot", tubeType()}, {"cooperative", catheterType()}, {"planar", planarType()}};
  return all;
}

}  // namespace

const RobotType& typeOf(const config::Robot& robot) {
  for (const Entry& entry : entries()) {
    if (robot.type == entry.kind)
      return entry.type;
  }
  throw std::invalid_argument("found a robot of the type '" + robot.type +
                              "', which robots/robot_type.cpp does not list");
}

const std::vector<const RobotType*>& robotTypes() {
  static const std::vector<const RobotType*> all = [] {
    std::vector<const RobotType*> types;
    for (const Entry& entry : entries())
      types.push_back(&entry.type);
    return types;
  }();
  return all;
}

idl::Model RobotType::model(const std::string& name) const {
  return idl::fromName<idl::Model>(name).value_or(idl::Model::kRigid);
}

std::unique_ptr<kinematics::ArmModel> RobotType::makeModel(const config::Robot&, int, const std::string&) const {
  throw std::invalid_argument("found " + description() + ", expected a type with independent tips");
}

std::string RobotType::elasticModel() const { return {}; }

std::string RobotType::tipColumn() const { return "stability"; }

double RobotType::tipValue(const config::Robot&, int, const kinematics::JointsRef&, const kinematics::Tip& tip) const {
  return tip.stability;
}

std::unique_ptr<Mechanism> RobotType::makeMechanism(const config::Robot&) const {
  throw std::invalid_argument("found " + description() + ", expected a type whose arms move a common object");
}

const config::GraspedObject* RobotType::graspedObject(const config::Robot&) const noexcept { return nullptr; }

}  // namespace tandem::robots
