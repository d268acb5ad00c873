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
  double wire_stiffness = 0.0;  ///< of the pull wires, N/m; 0: they do not stretch
  double outer_diameter = 0.0;  ///< of the bending end, m
  safety::ArmLimits limits;
  Eigen::VectorXd home;  ///< inside the limits
};

/** Object that the arms hold at home. There their tips touch it without a force. */
struct GraspedObject {
  double size = 0.0;  ///< m; characteristic length that makes a radian comparable to a metre
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< robot base frame <- object frame, at home
  std::vector<int> arms;                                   ///< arms of the contacts
  std::vector<kinematics::grasp::Contact> contacts;
  Eigen::Vector3d load = Eigen::Vector3d::Zero();  ///< force on the object at its origin, N, robot base frame
  double squeeze = 0.0;                            ///< required normal force at each contact, N
};

/** One arm pushes another one at the base of its bending section. */
struct Assistance {
  int target = 0, assist = 0;     ///< arms
  kinematics::assist::Pair pair;  ///< contact without a force at `press` less insertion of the assist arm than at home
  double press = 0.0;             ///< insertion of the assist arm's home beyond first contact, m
  double push = 0.0;              ///< required force along the contact normal, N; 0: that of home
};

/** Robot file of catheters. */
struct CooperativeRobot : TypeData {
  std::string name;
  std::vector<CatheterArm> arms;
  std::optional<GraspedObject> object;
  std::optional<Assistance> assistance;
  control::MethodParameters parameters;
  std::vector<std::string> warnings;
  std::filesystem::path file;

  /// Joint ranges of target and assist arm; only with an assistance.
  kinematics::assist::Range range() const;
  /// Home of both.
  kinematics::assist::Joints home() const;
};

/// @throw Error that names file, line, key, what was found and what was expected.
CooperativeRobot loadCooperative(const std::filesystem::path& file);

/// Indices of the arms that move the common object, in the order of the stacked joints: the arms at the object in the
/// order of its contacts, or the target arm and then the assist arm.
std::vector<int> armsInOrder(const CooperativeRobot& robot);

/// The same file for the services: `data` is the CooperativeRobot; names, limits and home of the arms that move the
/// common object.
/// @throw Error also for both object and assistance, or neither, for an unused arm, and for margins, which only
/// concentric tubes have.
Robot loadCatheterRobot(const std::filesystem::path& file);

/// Refuses values of a deployment that catheters do not support. @throw Error at the key.
void checkCatheterDeployment(const Map& map, const Deployment& deployment);

}  // namespace tandem::config
