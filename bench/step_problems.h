// SPDX-License-Identifier: Apache-2.0
/** @file Control steps that the methods are timed over. */
#pragma once

#include <cstdint>
#include <vector>

#include "control/step_problem.h"

namespace tandem::bench {

/// Steps of the two arms of Alsaka et al. 2024 at random joints inside equation (1): the relative position first, then
/// tip A, both asked for millimetres a second.
std::vector<control::StepProblem> randomSteps(int count, std::uint32_t seed);

}  // namespace tandem::bench
