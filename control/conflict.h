// SPDX-License-Identifier: Apache-2.0
/** @file Conflict analysis of an infeasible step: the limits that prevent a task, from the Farkas certificate. */
#pragma once

#include <string>
#include <vector>

#include "control/quadratic_program.h"
#include "control/solution.h"
#include "idl/enumerations.h"

namespace tandem::control {

/// Writes the limits of a certificate, the largest multiplier first; the QP's first joint_count variables are the
/// velocities, its rows those of the bounds. Allocates nothing.
void explain(const StepProblem& problem,
             const VelocityBounds& bounds,
             const QpSolution& certificate,
             Conflict& conflict) noexcept;

/// Writes the active limits of a solution's velocity, as a conflict of equal weights. Allocates nothing.
void standingAt(const StepProblem& problem, const Solution& solution, Conflict& conflict) noexcept;

using idl::LimitKind;
using idl::name;

/** Name of a limit, independent of the problem. */
struct NamedLimit {
  LimitKind kind = LimitKind::kNeighbour;
  int arm = 0;
  int tube = 1;  ///< counts from 1
};
NamedLimit nameOf(const StepProblem& problem, const Conflict::Limit& limit) noexcept;

/// Default name of an arm: a, b, ...
std::string armLetter(int arm);

/// "velocity limit of tube 2 of arm a". @param arms  names of the arms, in the robot's order; missing ones are replaced
/// by armLetter()
std::string describe(const NamedLimit& limit, const std::vector<std::string>& arms);

/** Text of a conflict: "tube 2 of arm a against tube 1, velocity limit of tube 2 of arm a". @param arms  as above */
std::string describe(const StepProblem& problem, const Conflict& conflict, const std::vector<std::string>& arms);

}  // namespace tandem::control
