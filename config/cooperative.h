// SPDX-License-Identifier: Apache-2.0
/** @file Robot files of cooperating catheters: a jointly grasped object, or a target catheter pushed by an assist
 * catheter. */
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"
#include "kinematics/assist/reach.h"
#include "kinematics/grasp/grasp.h"

namespace tandem::config {

class Map;

/// Joints of a catheter: m, rad, rad.
inline constexpr std::array kCatheterJoints{"insertion", "roll", "bend"};

/** One catheter. Joints: kCatheterJoints. */
struct CatheterArm {
  std::string name;
  kinematics::catheter::ElasticArm model;
  double tendon_offset = 0.0;   ///< distance of the pull wires from the axis, m
  double outer_diameter = 0.0;  ///< of the bending end, m
  safety::ArmLimits limits;
  Eigen::VectorXd home;  ///< inside the limits
};

/** What the arms hold at home. Their tips touch it there without a force. */
struct GraspedObject {
  double size = 0.0;                                       ///< m; makes a radian comparable to a metre
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< robot base frame <- object frame, at home
  std::vector<int> arms;                                   ///< of the contacts
  std::vector<kinematics::grasp::Contact> contacts;
  Eigen::Vector3d load = Eigen::Vector3d::Zero();  ///< force on the object at its origin, N, robot base frame
  double squeeze = 0.0;                            ///< normal force that is to be held at each contact, N
};

/** One arm pushes the base of bending of another one. */
struct Assistance {
  int target = 0, assist = 0;     ///< arms
  kinematics::assist::Pair pair;  ///< touches without a force where the assist arm is `press` short of home
  double press = 0.0;             ///< by which the assist arm's home is inserted beyond touching, m
  double push = 0.0;              ///< force along the contact's normal that is to be held, N; 0: that of home
};

/** A robot file of catheters. */
struct CooperativeRobot : TypeData {
  std::string name;
  std::vector<CatheterArm> arms;
  std::optional<GraspedObject> object;
  std::optional<Assistance> assistance;
  control::MethodParameters parameters;
  std::vector<std::string> warnings;
  std::filesystem::path file;

  /// Joint ranges of target and assist arm; with an assistance only.
  kinematics::assist::Range range() const;
  /// Home of both.
  kinematics::assist::Joints home() const;
};

/// @throw Error that names file, line, key, what was found and what was expected.
CooperativeRobot loadCooperative(const std::filesystem::path& file);

/// Arms that take part, by their numbers in the file, in the order of the stacked joints: those that hold the object in
/// the order of its contacts, or the target and then the arm that assists.
std::vector<int> armsInOrder(const CooperativeRobot& robot);

/// The same file for the services: `data` is the CooperativeRobot; names, limits and home of the arms that take part.
/// @throw Error also for both object and assistance, or neither, for an arm that takes no part, and for margins, which
/// only concentric tubes have.
Robot loadCatheterRobot(const std::filesystem::path& file);

/// Refuses values of a deployment that catheters cannot have. @throw Error at the key.
void checkCatheterDeployment(const Map& map, const Deployment& deployment);

}  // namespace tandem::config
