// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "config/cooperative.h"
#include "config/detail/loaders.h"
#include "config/file_tables.h"

namespace tandem::config {
namespace {

/// Refuses valid robot files that the services do not support.
void check(const CooperativeRobot& robot, const std::filesystem::path& file) {
  Document document(file.string(), readFile(file));
  const Map map = document.check(cooperativeTable());
  if (robot.object && robot.assistance)
    map.fail("assistance",
             "found both `object` and `assistance`, expected exactly one: a running system controls one common object");
  if (!robot.object && !robot.assistance)
    map.fail(
        "object",
        "found neither `object` nor `assistance`, expected exactly one: a running system controls one common object");
  const std::vector<int> order = armsInOrder(robot);
  const std::vector<Map> arms = map.maps("arms");
  for (std::size_t k = 0; k < arms.size(); ++k) {
    if (std::ranges::find(order, static_cast<int>(k)) == order.end())
      arms[k].fail("name", "found '" + robot.arms[k].name + "', which takes no part in the motion; add it to " +
                               (robot.object ? "object.contacts" : "assistance") + " or remove it");
  }
  const Map control = map.map("control");
  for (const char* key : {"least_stability", "least_distance"}) {
    if (control.number(key) > 0.0)
      control.fail(key, "found " + control.inUnit(key, control.number(key)) +
                            ", expected 0: margins are available for concentric tubes only");
  }
}

}  // namespace

std::vector<int> armsInOrder(const CooperativeRobot& robot) {
  if (robot.object)
    return robot.object->arms;
  if (robot.assistance)
    return {robot.assistance->target, robot.assistance->assist};
  return {};
}

Robot loadCatheterRobot(const std::filesystem::path& file) {
  auto catheters = std::make_shared<const CooperativeRobot>(loadCooperative(file));
  check(*catheters, file);
  Robot robot;
  robot.name = catheters->name;
  robot.type = "cooperative";
  robot.parameters = catheters->parameters;
  robot.warnings = catheters->warnings;
  robot.file = file;
  for (const int k : armsInOrder(*catheters)) {
    const CatheterArm& from = catheters->arms[static_cast<std::size_t>(k)];
    robot.arms.push_back({from.name, {kCatheterJoints.begin(), kCatheterJoints.end()}, {}, from.limits, from.home});
  }
  robot.data = std::move(catheters);
  return robot;
}

void checkCatheterDeployment(const Map& map, const Deployment& deployment) {
  const auto refuse = [&](const char* key, const std::string& found, const std::string& expected) {
    map.fail(key, "found " + found + " for the catheters of " + deployment.robot.filename().string() + ", expected " +
                      expected);
  };
  if (map.has("hardware"))
    refuse("hardware", "drives", "none: catheters are simulated");
  if (map.has("port"))
    refuse("port", "a port", "none: distances to the port are computed for concentric tubes only");
  if (map.has("plant"))
    refuse("plant", "a plant that differs", "none: the simulated catheters are those of the robot file");
  if (deployment.model != "rigid")
    refuse("model", "'" + deployment.model + "'", "no such key: catheters have a single, elastic model");
  if (deployment.feedback != planning::Feedback::kModel)
    refuse("feedback", "'" + map.text("feedback") + "'", "model: a tip tracker is not supported for a common object");
}

}  // namespace tandem::config
