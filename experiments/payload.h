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

/** Stiffness and payload in one direction, with the joints at standstill. */
struct Payload {
  double stiffness =
      0.0;            ///< force per displacement along the force, N/m; displacements in all other directions are free
  double load = 0.0;  ///< largest force on the object's origin in addition to the load of the file, N
  double sag = 0.0;   ///< displacement of the object under this force, m
  std::string limit;  ///< limit that a larger force exceeds
};

/** Equilibria to which loads are added: of all arms with their present squeeze, and of each single arm that carries the
 * object at the same joints. */
class PayloadStudy {
 public:
  /// @param mechanism  in equilibrium; outlives this
  PayloadStudy(const config::CooperativeRobot& robot, const GraspedObjectMechanism& mechanism);

  /// "all", then the arms by name.
  const std::vector<std::string>& carriers() const { return carriers_; }
  /// Reason why a carrier cannot carry the object; empty: it can.
  const std::string& refusal(std::size_t carrier) const { return refusals_[carrier]; }
  const kinematics::grasp::GraspEquilibrium& equilibrium(std::size_t carrier) const { return equilibria_[carrier]; }

  /// Raises the load in steps of a tenth of the permitted sag, and halves the last step until the load is known to a
  /// thousandth. Thread-safe. @param direction  unit vector, robot base frame
  Payload carried(std::size_t carrier, const Eigen::Vector3d& direction, const PayloadOptions& options) const;

 private:
  /// An equilibrium under a larger load, or the reason why there is none.
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
