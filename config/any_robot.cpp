// SPDX-License-Identifier: Apache-2.0
#include "config/any_robot.h"

#include <algorithm>

#include "config/file_tables.h"
#include "config/loaders.h"

namespace tandem::config {
namespace {

/// What the services do not run although the file is good.
void check(const CooperativeRobot& robot, const std::filesystem::path& file) {
  Document document(file.string(), readFile(file));
  const Map map = document.check(cooperativeTable());
  if (robot.object && robot.assistance)
    map.fail("assistance", "found beside an object, expected one of them: a running system moves one thing");
  if (!robot.object && !robot.assistance)
    map.fail("object", "found neither object nor assistance, expected one of them: what a running system moves");
  const std::vector<int> order = armsInOrder(robot);
  const std::vector<Map> arms = map.maps("arms");
  for (std::size_t k = 0; k < arms.size(); ++k) {
    if (std::ranges::find(order, static_cast<int>(k)) == order.end())
      arms[k].fail("name", "found '" + robot.arms[k].name + "', which takes no part, expected it in " +
                               (robot.object ? "object.contacts" : "assistance") + ", or not at all");
  }
  const Map control = map.map("control");
  for (const char* key : {"least_stability", "least_distance"}) {
    if (control.number(key) > 0.0)
      control.fail(key, "found " + control.inUnit(key, control.number(key)) +
                            ", expected 0: margins are kept of concentric tubes alone");
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

Robot loadAnyRobot(const std::filesystem::path& file) {
  if (kindOf(file) != "cooperative")
    return loadRobot(file);
  auto catheters = std::make_shared<const CooperativeRobot>(loadCooperative(file));
  check(*catheters, file);
  Robot robot;
  robot.name = catheters->name;
  robot.parameters = catheters->parameters;
  robot.warnings = catheters->warnings;
  robot.file = file;
  for (const int k : armsInOrder(*catheters)) {
    const CatheterArm& from = catheters->arms[static_cast<std::size_t>(k)];
    Arm arm;
    arm.name = from.name;
    arm.limits = from.limits;
    arm.home = from.home;
    robot.arms.push_back(std::move(arm));
  }
  robot.catheters = std::move(catheters);
  return robot;
}

}  // namespace tandem::config
