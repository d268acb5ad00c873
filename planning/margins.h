// SPDX-License-Identifier: Apache-2.0
/** @file Margin constraints of a control step (velocity dampers) for elastic stability and for the distance between
 * arms. */
#pragma once

#include <array>
#include <vector>

#include "control/parameters.h"
#include "control/solution.h"
#include "control/step_problem.h"
#include "kinematics/body_builder.h"
#include "planning/reference.h"
#include "planning/tips.h"

namespace tandem::planning {

/** Writes the margins of a step, linear in the joint velocities, as velocity dampers:
 *
 *   grad h^T qdot >= -barrier_gain (h - least - r),
 *
 * h being the stability of each arm (Tip::stability) with least_stability and, for each relative task of a reference,
 * the distance between the bodies of its two arms with least_distance. What has least value 0 is left out. A step goes
 * on for a period, and h is not linear: keep() shortens what would end below the least value. r, zero until then, makes
 * the next steps move away from it first, so that a way along the margin does not end there. Nothing after construction
 * allocates. */
class Margins {
 public:
  Margins(std::vector<const kinematics::ArmModel*> models, const control::MethodParameters& parameters);

  /// @param q  of all arms, where `tips` has followed them
  void set(const TipFollower& tips,
           const safety::RobotVector& q,
           const Reference& reference,
           control::StepProblem& problem);

  /// Halves the velocity that a method has found for what set() wrote until no margin ends the period below its least
  /// value, or below what it is now where that is less; at rest in the end.
  void keep(const TipFollower& tips,
            const safety::RobotVector& q,
            const control::StepProblem& problem,
            control::Solution& solution);

 private:
  struct Margin {
    int arm = 0, other = -1;  ///< other arm: their distance; -1: the arm's stability
    double least = 0.0, now = 0.0;
    int id = 0;  ///< the same from step to step
  };
  void add(const Margin& margin, control::StepProblem& problem);
  void addDistance(const TipFollower& tips,
                   const safety::RobotVector& q,
                   int a,
                   int b,
                   int id,
                   control::StepProblem& problem);
  bool makeBodies(const TipFollower& tips,
                  const safety::RobotVector& q,
                  int a,
                  int b,
                  bool derivatives,
                  const control::StepProblem& problem);
  double at(const Margin& margin,
            const TipFollower& tips,
            const safety::RobotVector& q,
            const control::StepProblem& problem);

  std::vector<const kinematics::ArmModel*> models_;
  double period_, gain_, least_stability_, least_distance_;
  std::array<Margin, control::kMaxBarriers> margins_{};
  std::array<double, control::kMaxBarriers> reserve_{};  ///< r, by id
  kinematics::BodyBuilder bodies_;
  kinematics::Body body_a_, body_b_;
  kinematics::Tip tip_;
};

}  // namespace tandem::planning
