// SPDX-License-Identifier: Apache-2.0
/** @file Equilibrium follower of a mechanism, its conversion to planning::Equilibrium, and the midpoint control step.
 */
#pragma once

#include <memory>

#include "planning/reference_tracker.h"
#include "robots/mechanism.h"

namespace tandem::robots {

/// Writes the equilibrium of a mechanism. @param q  its joints, m and rad
/// @throw std::invalid_argument for more tasks or rows than control/ accepts.
void writeEquilibrium(const Mechanism& mechanism, const RobotVector& q, planning::Equilibrium& equilibrium);

/** A mechanism that follows moving joints. Large motions are divided into small steps, so that it stays on its branch
 * of equilibria. Allocates. */
class EquilibriumFollower {
 public:
  /// Starts in the equilibrium at home. @throw std::invalid_argument with the reason if there is none.
  explicit EquilibriumFollower(std::unique_ptr<Mechanism> mechanism);

  /// Moves to joints, m and rad. @return empty, or why a step has no equilibrium; the last one then stays valid
  std::string solveEquilibrium(const RobotVector& q);
  const RobotVector& joints() const { return joints_; }  ///< of the last equilibrium
  const Mechanism& mechanism() const { return *mechanism_; }

 private:
  std::unique_ptr<Mechanism> mechanism_;
  RobotVector joints_;
};

/** One control period with the joint velocities of its midpoint (midpoint rule, second order). Those of its start would
 * open the contacts, because the orientation of the arms changes much in one period.
 *
 * Solves at the joints, then at the predicted joints of the midpoint. `result` is that of the midpoint, except for the
 * error, which is that of the start.
 * @param solve  computes the equilibrium at joints, as Mechanism::solveEquilibrium()  @param q  joints;
 * limits refer to them
 * @return empty, or why there is no equilibrium; see also result.status */
template <class SolveEquilibrium>
std::string stepByMiddle(const Mechanism& mechanism,
                         const SolveEquilibrium& solve,
                         planning::ReferenceTracker& tracker,
                         const RobotVector& q,
                         const planning::ObjectReference& reference,
                         double period,
                         planning::Equilibrium& equilibrium,
                         planning::TrackResult& result) {
  if (std::string why = solve(q); !why.empty())
    return why;
  writeEquilibrium(mechanism, q, equilibrium);
  tracker.step(equilibrium, q, q, reference, result);
  if (result.status != planning::TrackStatus::kOk)
    return {};
  const double error = result.error[0];
  const RobotVector middle = tracker.moved(q, 0.5 * period * result.solution.velocity);
  if (std::string why = solve(middle); !why.empty())
    return why;
  writeEquilibrium(mechanism, middle, equilibrium);
  tracker.step(equilibrium, middle, q, reference.after(0.5 * period), result);
  result.error[0] = error;
  return {};
}

}  // namespace tandem::robots
