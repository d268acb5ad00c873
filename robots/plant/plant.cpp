// SPDX-License-Identifier: Apache-2.0
#include "robots/plant/plant.h"

#include <stdexcept>

#include "robots/robot_type.h"

namespace tandem::robots {
namespace {

void checkTubes(const config::Robot& robot, const sim::PlantOptions& options) {
  for (const config::Arm& arm : robot.arms) {
    const bool errors = options.tube_deviation != sim::TubeErrors{} || options.friction > 0.0 ||
                        options.clearance > 0.0 || options.ovality > 0.0;
    if (arm.model.tubes.empty() && errors)
      throw std::invalid_argument("plant: found errors of tubes for " + arm.name + ", which has no tubes");
  }
  const int count = static_cast<int>(robot.arms.size());
  for (const sim::FixedTubeErrors& fixed : options.tube_errors) {
    if (fixed.arm < 0 || fixed.arm >= count || fixed.tube < 0 ||
        fixed.tube >= robot.arms[static_cast<std::size_t>(fixed.arm)].model.tubeCount())
      throw std::invalid_argument("plant.tube_errors: found tube " + std::to_string(fixed.tube + 1) + " of arm " +
                                  std::to_string(fixed.arm + 1) + ", which the robot does not have");
  }
}

}  // namespace

sim::PlantTips makePlantTips(const config::Robot& robot, const sim::PlantOptions& options) {
  checkTubes(robot, options);
  config::Robot plant = robot;
  sim::ArmModels models;
  std::vector<sim::TubeContact> contacts;
  for (std::size_t k = 0; k < plant.arms.size(); ++k) {
    const int arm = static_cast<int>(k);
    plant.arms[k].model = sim::withErrors(plant.arms[k].model, arm, options);
    models.push_back(typeOf(plant).makeModel(plant, arm, options.model));
    contacts.push_back(sim::makeContact(plant.arms[k].model, robot.arms[k].model, options));
  }
  return {std::move(models), options, std::move(contacts)};
}

}  // namespace tandem::robots
