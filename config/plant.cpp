// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "config/loaders.h"

namespace tandem::config {
namespace {

sim::JointMechanics readMotors(const Map& map) {
  return {map.number("delay"),
          {map.number("lag_translation"), map.number("lag_rotation")},
          {map.number("backlash_translation"), map.number("backlash_rotation")}};
}

sim::EncoderOptions readEncoders(const Map& map) {
  return {{map.number("resolution_translation"), map.number("resolution_rotation")},
          {map.number("noise_translation"), map.number("noise_rotation")}};
}

sim::TubeErrors readErrors(const Map& map) {
  return {map.number("bending_stiffness"), map.number("torsional_stiffness"), map.number("curvature"),
          map.number("length")};
}

sim::TipTrackerOptions readTracker(const Map& map, bool present) {
  return {present,
          map.number("rate"),
          map.number("position_noise"),
          map.number("rotation_noise"),
          map.number("delay"),
          map.number("drop_out")};
}

int readPlantArm(const Map& map, const Robot& robot) {
  const std::string name = map.text("arm");
  std::vector<std::string> names;
  for (const Arm& arm : robot.arms)
    names.push_back(arm.name);
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    map.fail("arm", "found '" + name + "', expected an arm of the robot: " + join(names));
  return static_cast<int>(found - names.begin());
}

sim::GivenTubeErrors readTubeErrors(const Map& map, const Robot& robot) {
  sim::GivenTubeErrors given{readPlantArm(map, robot), map.integer("tube") - 1, readErrors(map)};
  const int count = robot.arms[static_cast<std::size_t>(given.arm)].model.tubeCount();
  if (given.tube >= count)
    map.fail("tube", "found " + std::to_string(given.tube + 1) + ", expected 1 to " + std::to_string(count));
  return given;
}

}  // namespace

sim::PlantOptions readPlant(const Map& map, const std::filesystem::path& robot_file) {
  sim::PlantOptions plant;
  plant.model = map.text("model");
  plant.seed = static_cast<std::uint64_t>(map.integer("seed"));
  plant.mechanics = readMotors(map.map("motors"));
  plant.encoders = readEncoders(map.map("encoders"));
  plant.tube_deviation = readErrors(map.map("tube_deviation"));
  plant.tracker = readTracker(map.map("tracker"), map.has("tracker"));
  const std::vector<Map> tubes = map.maps("tube_errors"), forces = map.maps("tip_forces");
  if (tubes.empty() && forces.empty())
    return plant;
  const Robot robot = loadRobot(robot_file);
  for (const Map& entry : tubes)
    plant.tube_errors.push_back(readTubeErrors(entry, robot));
  if (!forces.empty() && plant.model == "rigid")
    map.fail("tip_forces", "found forces on a rigid plant, which does not yield; expected model: compliant");
  for (const Map& entry : forces)
    plant.tip_forces.push_back({readPlantArm(entry, robot), entry.vector3("force")});
  return plant;
}

}  // namespace tandem::config
