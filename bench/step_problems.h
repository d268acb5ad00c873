// SPDX-License-Identifier: Apache-2.0
/** @file Control steps for benchmarks of the methods. */
#pragma once

#include <cstdint>
#include <vector>

#include "control/quadratic_program.h"
#include "control/step_problem.h"
#include "kinematics/concentric_tube.h"

namespace tandem::bench {

/// Equation (1) for an arm, with 5 mm/s and 1 mm/s^2.
safety::ArmLimits limitsOf(const kinematics::ConcentricTubeArm& arm);

/// Steps of the two arms of Alsaka et al. 2024 at random joints inside equation (1): the relative position first, then
/// tip A, with desired velocities of a few mm/s.
std::vector<control::StepProblem> randomSteps(int count, std::uint32_t seed);

/// Twelve variables between bounds, three equalities, rows; strictly convex, with a point that satisfies all.
control::QuadraticProgram randomProgram(std::uint32_t seed, int rows);

}  // namespace tandem::bench
