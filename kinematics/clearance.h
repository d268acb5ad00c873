// SPDX-License-Identifier: Apache-2.0
/** @file Distances between the bodies of arms and to the port, with gradients. */
#pragma once

#include <vector>

#include "kinematics/arm_model.h"

namespace tandem::kinematics {

/** Body of an arm in front of the entry point: capsules along its backbone.
 *
 * The part of the backbone on which tube i is the outermost, from the end of tube i+1 to its own end, is cut into
 * kPieces pieces of equal length, each a capsule with the tube's outer radius. So the body changes continuously with
 * the joints, and its nodes move with the tubes' ends. The distance of a chord from the backbone is at most h^2 kappa /
 * 8 (35 um for pieces of 5 mm bent by 11 1/m): add it to a required clearance where it matters. */
struct Body {
  static constexpr int kPieces = 32;
  std::vector<BackbonePoint> nodes;  ///< Jacobians are total: nodes move along with the tubes' ends
  std::vector<double> radius;        ///< of the piece after each node, m; one fewer than nodes
  int joints = 0;
};

/// @param derivatives clearances of the body have gradients
ModelStatus makeBody(const ArmModel& model, const JointsRef& q, Branch& branch, bool derivatives, Body& body);

/** Common port of the arms: a plate with a round hole, in the robot base frame. The plate fills {z <= depth, rho >=
 * radius} in the port's frame, whose z points into the body; so depth > 0 is a tube that the arms leave at its distal
 * end. */
struct Port {
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();  ///< robot base frame <- port frame
  double radius = 0.0;                                      ///< of the hole, m
  double depth = 0.0;                                       ///< distance of its rim in front of the entry plane, m
};

/** Smallest distance between surfaces. */
struct Clearance {
  double distance = 0.0;  ///< m; below zero: depth of the overlap
  Eigen::Vector3d place_a = Eigen::Vector3d::Zero(),
                  place_b = Eigen::Vector3d::Zero();  ///< on the backbones (port: on a's)
  double s_a = 0.0, s_b = 0.0;                        ///< arc lengths of these points, m
  Gradient by_a, by_b;  ///< of the distance by the joints; empty without derivatives. One-sided at ties.
};

/// Smallest distance of two whole bodies.
Clearance clearance(const Body& a, const Body& b);

/// Smallest distance of a body to the port.
Clearance clearance(const Body& a, const Port& port);

}  // namespace tandem::kinematics
