// SPDX-License-Identifier: Apache-2.0
/** @file tandem cooperative mobility: possible motions of a grasped object. */
#include <Eigen/Eigenvalues>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "robots/catheters.h"
#include "services/cli/models/arm_options.h"
#include "services/cli/models/cooperative.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {
namespace {

using Json = nlohmann::ordered_json;
namespace grasp = kinematics::grasp;

struct MobilityCommand {
  std::string robot = "ablation-pair", contact = "all", joints;
  bool json = false;
};

Json texts(const grasp::Twists& twists, double length) {
  Json list = Json::array();
  for (Eigen::Index k = 0; k < twists.cols(); ++k)
    list.push_back(grasp::describe(twists.col(k), length));
  return list;
}

/// Stiffness of the object in its softest and stiffest direction of translation, N/m.
std::pair<double, double> stiffnessRange(const grasp::Matrix6& stiffness) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> values(
      0.5 * (stiffness + stiffness.transpose()).topLeftCorner<3, 3>());
  return {values.eigenvalues()[0], values.eigenvalues()[2]};
}

/// In equilibrium at the joints given, or at home, without what only a controller brings about: squeeze.
Json mobility(config::CooperativeRobot robot, const std::string& type, const MobilityCommand& options) {
  if (!type.empty()) {
    for (grasp::Contact& contact : robot.object->contacts)
      contact.type = grasp::contactType(type);
  }
  robot.object->load.setZero();  // what can be moved is asked without it: at home nothing presses yet
  robots::GraspedObjectMechanism mechanism(robot);
  robots::RobotVector q = mechanism.home();
  if (!options.joints.empty())
    q = numbersOf("--joints", options.joints, static_cast<int>(q.size()));
  Json json{{"contact", type.empty() ? "file" : type}};
  if (const std::string why = mechanism.solveEquilibrium(q); !why.empty()) {
    json["refused"] = why;
    return json;
  }
  const grasp::GraspState& state = mechanism.state();
  const double length = mechanism.grasp().length();
  json["rank"] = state.rank;
  json["mobility"] = state.mobility;
  json["object_mobility"] = state.object_mobility;
  json["self_motions"] = state.self_motions;
  json["internal_forces"] = state.internal_forces.cols();
  json["squeezes"] = state.squeezes;
  json["manipulability"] = state.manipulability;
  json["least_gain"] = state.least_gain;
  json["movable"] = texts(state.movable, length);
  json["missing"] = texts(state.missing, length);
  json["unrestrained"] = texts(state.unrestrained, length);
  json["degenerate"] = grasp::describeDegeneracies(state.degeneracies);
  const auto [softest, stiffest] = stiffnessRange(mechanism.stiffness());
  json["actuation"] = actuationOf(robot);
  json["stiffness_N_per_m"] = {softest, stiffest};
  for (std::size_t k = 0; k < robot.object->contacts.size(); ++k) {
    const auto [alone_softest, alone_stiffest] = stiffnessRange(mechanism.stiffnessOf(static_cast<int>(k)));
    json["stiffness_of_one_arm_N_per_m"].push_back({alone_softest, alone_stiffest});
  }
  return json;
}

std::string listed(const Json& list) {
  std::string text;
  for (const Json& word : list)
    text += (text.empty() ? "" : ", ") + word.get<std::string>();
  return text.empty() ? "none" : text;
}

void printMobility(const Json& json) {
  std::printf("%s contacts\n", json["contact"].get<std::string>().c_str());
  if (json.contains("refused")) {
    std::printf("  no equilibrium: %s\n", json["refused"].get<std::string>().c_str());
    return;
  }
  std::printf("  rank of B (J - G^T) %d, mobility %d, of the object %d, self-motions %d\n", json["rank"].get<int>(),
              json["mobility"].get<int>(), json["object_mobility"].get<int>(), json["self_motions"].get<int>());
  std::printf("  internal forces %d, of which joints change %d\n", json["internal_forces"].get<int>(),
              json["squeezes"].get<int>());
  std::printf("  manipulability %.4g, least gain %.4g\n", json["manipulability"].get<double>(),
              json["least_gain"].get<double>());
  std::printf("  movable: %s\n  missing: %s\n", listed(json["movable"]).c_str(), listed(json["missing"]).c_str());
  if (!json["unrestrained"].empty())
    std::printf("  constrained by no contact: %s\n", listed(json["unrestrained"]).c_str());
  if (json["degenerate"] != "")
    std::printf("  degenerate: %s\n", json["degenerate"].get<std::string>().c_str());
  const auto range = [](const Json& list) {
    char text[64];
    std::snprintf(text, sizeof text, "%.3g to %.3g N/m", list[0].get<double>(), list[1].get<double>());
    return std::string(text);
  };
  std::printf("  stiffness of the object at constant %s, by direction: %s",
              json["actuation"].get<std::string>().c_str(), range(json["stiffness_N_per_m"]).c_str());
  for (const Json& one : json["stiffness_of_one_arm_N_per_m"])
    std::printf("; one arm alone %s", range(one).c_str());
  std::printf("\n");
}

int runMobility(const MobilityCommand& options) {
  const config::CooperativeRobot robot = cooperativeRobot(options.robot);
  if (!robot.object)
    throw Failure(kUsage, robot.file.string() + ": object: found none, expected one for this command");
  Json all = Json::array();
  const std::vector<std::string> types = options.contact == "all"
                                             ? std::vector<std::string>{"rigid", "soft_finger", "point"}
                                         : options.contact == "file" ? std::vector<std::string>{""}
                                                                     : std::vector<std::string>{options.contact};
  bool good = true;
  for (const std::string& type : types) {
    all.push_back(mobility(robot, type, options));
    good = good && !all.back().contains("refused");
    if (!options.json)
      printMobility(all.back());
  }
  if (options.json)
    std::cout << all.dump(2) << '\n';
  return good ? kOk : kFailure;
}

}  // namespace

void registerMobility(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<MobilityCommand>();
  CLI::App* command =
      app.add_subcommand("mobility", "motions of a grasped object: possible and missing directions, manipulability");
  command->add_option("-r,--robot", options->robot, "cooperative robot file or preset")->capture_default_str();
  command
      ->add_option("--contact", options->contact,
                   "contact type; all: rigid, soft_finger and point; file: as in the robot file")
      ->check(CLI::IsMember({"all", "file", "frictionless", "point", "soft_finger", "rigid"}))
      ->capture_default_str();
  command->add_option("--joints", options->joints, "insertion,roll,bend of each arm, m and rad, instead of home");
  command->add_flag("--json", options->json, "JSON instead of text");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return runMobility(*options); }); });
}

}  // namespace tandem::cli
