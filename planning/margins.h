// SPDX-License-Identifier: Apache-2.0
/** @file Margins that control keeps ahead of all tasks: elastic stability, and the distance between arms. */
#pragma once

#include <vector>

#include "control/parameters.h"
#include "control/step_problem.h"
#include "kinematics/clearance.h"
#include "planning/reference.h"
#include "planning/tips.h"

namespace tandem::planning {

/** Writes the margins of a step, linear in the joint velocities, as velocity dampers:
 *
 *   grad h^T qdot >= -barrier_gain (h - least),
 *
 * h being the stability of each arm (Tip::stability) with least_stability and, for each relative task of a reference,
 * the distance between the bodies of its two arms with least_distance. What has least value 0 is left out. Distances
 * allocate: they are not for a loop in real time. */
class Margins {
 public:
  Margins(std::vector<const kinematics::ArmModel*> models, const control::MethodParameters& parameters);

  /// @param q  of all arms, where `tips` has followed them
  void set(const TipFollower& tips,
           const safety::RobotVector& q,
           const Reference& reference,
           control::StepProblem& problem);

 private:
  void add(double value, double least, control::StepProblem& problem) const;
  void addDistance(const TipFollower& tips, const safety::RobotVector& q, int a, int b, control::StepProblem& problem);

  std::vector<const kinematics::ArmModel*> models_;
  double gain_, least_stability_, least_distance_;
  kinematics::Body body_a_, body_b_;
};

}  // namespace tandem::planning
