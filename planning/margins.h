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
 *     grad h^T qdot >= -barrier_gain (h - least - r),
 *
 * where h is the stability of each arm (Tip::stability) with least_stability and, for each relative task of a
 * reference, the distance between the bodies of its two arms with least_distance. A least value of 0 means no margin. A
 * step lasts one period, and h is not linear: keep() shortens a step that would end below the least value. The reserve
 * r, zero until then, makes the next steps move away from the margin first, so that motion along it does not stop
 * there. Nothing after construction allocates. */
class Margins {
 public:
  Margins(std::vector<const kinematics::ArmModel*> models, const control::MethodParameters& parameters);

  /// @param q  of all arms; `tips` has been updated with it
  void set(const TipFollower& tips,
           const safety::RobotVector& q,
           const Reference& reference,
           control::StepProblem& problem);

  /// Halves the solution's velocity until no margin ends the period below its least value, or below its present value
  /// if that is smaller; finally sets it to zero.
  void keep(const TipFollower& tips,
            const safety::RobotVector& q,
            const control::StepProblem& problem,
            control::Solution& solution);

 private:
  struct Margin {
    int arm = 0, other = -1;  ///< other arm of a distance; -1: the arm's stability
    double least = 0.0, now = 0.0;
    int id = 0;  ///< constant from step to step
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
