// SPDX-License-Identifier: Apache-2.0
/** @file Comparison of a recorded run with a new simulation of it. */
#pragma once

#include "services/cli/recordings/recordings.h"

namespace tandem::cli {

/// Feeds the recorded commands, requests and stops of a lock-step run to a simulator with the recorded configuration,
/// compares its states with the recorded ones bit by bit, and prints the result.
/// @return exit code @throw Failure if the recording is not a complete lock-step run of a simulator.
int resimulate(Recording& recording);

}  // namespace tandem::cli
