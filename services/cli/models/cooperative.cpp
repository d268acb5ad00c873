// SPDX-License-Identifier: Apache-2.0
/** @file tandem cooperative: computations for cooperating catheters. */
#include "services/cli/models/cooperative.h"

#include "config/config.h"
#include "services/cli/models/arm_options.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {

config::CooperativeRobot cooperativeRobot(const std::string& name) {
  return config::loadCooperative(config::findFile(name, "cooperative"));
}

void addGraspOptions(CLI::App& command, GraspOptions& options) {
  command.add_option("-r,--robot", options.robot, "cooperative robot file or preset")->capture_default_str();
  command.add_option("--contact", options.contact, "contact type instead of the file's")
      ->check(CLI::IsMember({"frictionless", "point", "soft_finger", "rigid"}));
  command.add_option("--squeeze", options.squeeze, "normal force to maintain at each contact instead of the file's, N")
      ->check(client::kNonNegative);
  command.add_option("--load", options.load, "force x,y,z on the object instead of the file's, N");
}

config::CooperativeRobot graspingRobot(const GraspOptions& options) {
  config::CooperativeRobot robot = cooperativeRobot(options.robot);
  if (!robot.object)
    throw Failure(kUsage, robot.file.string() + ": object: found none, expected one for this command");
  if (!options.contact.empty()) {
    for (auto& contact : robot.object->contacts)
      contact.type = kinematics::grasp::contactType(options.contact);
  }
  if (options.squeeze)
    robot.object->squeeze = *options.squeeze;
  if (!options.load.empty())
    robot.object->load = numbersOf("--load", options.load, 3);
  return robot;
}

std::string actuationOf(const config::CooperativeRobot& robot) {
  std::string each;
  bool alike = true;
  for (const config::CatheterArm& arm : robot.arms) {
    alike = alike && arm.model.actuation == robot.arms.front().model.actuation;
    each += (each.empty() ? "" : ", ") + arm.name + ": " + std::string(nameOf(arm.model.actuation));
  }
  return (alike ? std::string(nameOf(robot.arms.front().model.actuation)) : each) + " of the pull wires";
}

void registerCooperative(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand(
      "cooperative", "cooperating catheters: a jointly grasped object, or a target arm pushed by an assist arm");
  command->require_subcommand(1);
  registerTracks(*command, exit_code);
  registerMobility(*command, exit_code);
  registerPayload(*command, exit_code);
  registerReach(*command, exit_code);
}

}  // namespace tandem::cli
