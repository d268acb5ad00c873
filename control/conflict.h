// SPDX-License-Identifier: Apache-2.0
/** @file Conflict analysis of an infeasible step: the limits that prevent a task, from the Farkas certificate. */
#pragma once

#include <string>
#include <vector>

#include "control/quadratic_program.h"
#include "control/solution.h"
#include "idl/enumerations.h"

namespace tandem::control {

/// Takes the limits of a certificate, the heaviest first; the QP's first joint_count variables are the velocities, its
/// rows those of the bounds. Allocates nothing.
void explain(const StepProblem& problem,
             const VelocityBounds& bounds,
             const QpSolution& certificate,
             Conflict& conflict) noexcept;

/// The limits at which a solution's velocity stands, as a conflict of equal weights. Allocates nothing.
void standingAt(const StepProblem& problem, const Solution& solution, Conflict& conflict) noexcept;

using idl::LimitKind;
using idl::name;

/** A limit without the problem that it belongs to. */
struct NamedLimit {
  LimitKind kind = LimitKind::kNeighbour;
  int arm = 0;
  int tube = 1;  ///< counts from 1
};
NamedLimit nameOf(const StepProblem& problem, const Conflict::Limit& limit) noexcept;

/// What an arm without a name is called: a, b, ...
std::string armLetter(int arm);

/// "velocity limit of tube 2 of arm a". @param arms  names of the arms, in the robot's order; those missing go by
/// letters
std::string describe(const NamedLimit& limit, const std::vector<std::string>& arms);

/** In words: "tube 2 of arm a against tube 1, velocity limit of tube 2 of arm a".
 * @param arms  as above */
std::string describe(const StepProblem& problem, const Conflict& conflict, const std::vector<std::string>& arms);

}  // namespace tandem::control
