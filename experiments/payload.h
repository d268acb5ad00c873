// SPDX-License-Identifier: Apache-2.0
/** @file Stiffness and payload of a grasped object by direction, held by all arms and by each arm alone. */
#pragma once

#include <string>
#include <vector>

#include "robots/catheters.h"

namespace tandem::experiments {

using robots::GraspedObjectMechanism;
using safety::RobotVector;

struct PayloadOptions {
  double most_sag = 10e-3;  ///< m: the object may give way so far
  double most_load = 10.0;  ///< N, where the search ends
};

/** In one direction, the joints standing still. */
struct Payload {
  double stiffness = 0.0;  ///< force for a displacement along itself, N/m, all else free to follow
  double load = 0.0;       ///< largest force on the object's origin that it carries on top of the one it has, N
  double sag = 0.0;        ///< by how much the object has given way under it, m
  std::string limit;       ///< what a larger one would do
};

/** Rests from which loads are added: of all arms as they press now, and of each one alone that holds the object by
 * itself at the same joints. */
class PayloadStudy {
 public:
  /// @param mechanism  in equilibrium; outlives this
  PayloadStudy(const config::CooperativeRobot& robot, const GraspedObjectMechanism& mechanism);

  /// "all", then the arms by name.
  const std::vector<std::string>& carriers() const { return carriers_; }
  /// Why a carrier holds nothing; empty where it does.
  const std::string& refusal(std::size_t carrier) const { return refusals_[carrier]; }
  const kinematics::grasp::GraspEquilibrium& equilibrium(std::size_t carrier) const { return equilibria_[carrier]; }

  /// The load grows in steps of a tenth of the sag that is allowed, and the last step is halved until it is known to a
  /// thousandth. Many threads may ask at once. @param direction  of size one, robot base frame
  Payload carried(std::size_t carrier, const Eigen::Vector3d& direction, const PayloadOptions& options) const;

 private:
  /// An equilibrium under more load, or why it is none.
  struct Attempt {
    kinematics::grasp::GraspEquilibrium equilibrium;
    std::string limit;
  };
  Attempt add(std::size_t carrier,
              const kinematics::grasp::GraspEquilibrium& from,
              const Eigen::Vector3d& force,
              double most_sag) const;
  std::string limitOf(std::size_t carrier,
                      const kinematics::grasp::GraspEquilibrium& equilibrium,
                      double most_sag) const;

  std::vector<config::CooperativeRobot> alone_;
  std::vector<std::unique_ptr<GraspedObjectMechanism>> owned_;
  std::vector<const GraspedObjectMechanism*> mechanisms_;
  std::vector<RobotVector> joints_;
  std::vector<kinematics::Wrench> loads_;
  std::vector<kinematics::grasp::GraspEquilibrium> equilibria_;
  std::vector<std::string> carriers_, refusals_;
};

}  // namespace tandem::experiments
