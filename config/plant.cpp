// SPDX-License-Identifier: Apache-2.0
#include "config/arm_names.h"
#include "config/detail/loaders.h"
#include "config/file_tables.h"
#include "config/robot_files.h"

namespace tandem::config {
namespace {

int readPlantArm(const Map& map, const Robot& robot) {
  return static_cast<int>(map.indexAmong("arm", armList(robot), "an arm of the robot: " + armNames(robot)));
}

sim::FixedTubeErrors readTubeErrors(const Map& map, const Robot& robot) {
  sim::FixedTubeErrors fixed{readPlantArm(map, robot), map.integer("tube") - 1, map.read<sim::TubeErrors>()};
  const int count = robot.arms[static_cast<std::size_t>(fixed.arm)].model.tubeCount();
  if (fixed.tube >= count)
    map.fail("tube", "found " + std::to_string(fixed.tube + 1) + ", expected 1 to " + std::to_string(count));
  return fixed;
}

}  // namespace

sim::PlantOptions readPlant(const Map& map, const std::function<Robot()>& robot_of) {
  auto plant = map.read<sim::PlantOptions>();
  plant.tracker.present = map.has("tracker");
  const std::vector<Map> tubes = map.maps("tube_errors"), forces = map.maps("tip_forces");
  if (tubes.empty() && forces.empty())
    return plant;
  const Robot robot = robot_of();
  for (const Map& entry : tubes)
    plant.tube_errors.push_back(readTubeErrors(entry, robot));
  if (!forces.empty() && plant.model == "rigid")
    map.fail("tip_forces", "found forces on a rigid plant, which does not yield; expected model: compliant");
  for (const Map& entry : forces)
    entry.read(plant.tip_forces.emplace_back(sim::TipForce{readPlantArm(entry, robot)}));
  return plant;
}

sim::PlantOptions parsePlant(const std::string& yaml, const std::string& origin, const Robot& robot) {
  Document document(origin, yaml);
  const sim::PlantOptions plant = readPlant(document.check(plantTable()), [&] { return robot; });
  document.finish();
  return plant;
}

}  // namespace tandem::config
